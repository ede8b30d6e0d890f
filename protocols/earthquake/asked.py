"""What one record asks of table, shaker and specimen: the largest value of every limited quantity."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.starts import CATCH_ANGLE
from bench.control.target import integrated
from bench.guard.limits import Limits
from bench.guard.quantities import Mover
from bench.preflight.response import TableResponse
from protocols.earthquake.records import Shaking
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Specimen

Array = NDArray[np.float64]

STEP = 0.005
"""Distance of the samples of a simulated motion [s]: a peak between two is missed by 0.2 % at most."""

TOLERANCE = 1e-7


@dataclass(frozen=True)
class Travel:
    """Greatest magnitudes [m] of what the lasers see and of the drift; when the block `toppled` [s], if it did."""

    storey_1: float
    storey_2: float
    drift: float
    toppled: float | None


def travel(specimen: Specimen, shaking: Shaking, factor: float, grounded: bool) -> Travel:
    """Simulated from rest under `factor` times the record, up to where the block falls if it does."""
    record = shaking.prepared.record
    times = np.arange(0.0, record.duration, STEP)
    motion = simulate(
        specimen,
        SampledRecord(factor * record.acceleration, record.dt),
        sample_times=times,
        peaks_from=None,
        tolerance=TOLERANCE,
        overturning_angle=CATCH_ANGLE,
    )
    moved = np.zeros((1, 6)) if motion.samples is None or not len(motion.samples) else motion.samples
    u1, u2 = moved[:, 0], moved[:, 1]
    table = np.zeros(len(moved))
    if grounded:
        places = np.arange(record.acceleration.size) * record.dt
        table = factor * np.interp(times[: len(moved)], places, shaking.prepared.motion.displacement)
    seen = (float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1))
    return Travel(*seen, toppled=None if motion.overturned is None else motion.end_time)


def load(
    shaking: Shaking, payload: float, configuration: BenchConfiguration, response: TableResponse | None
) -> dict[str, float]:
    """The largest value of each quantity of table and shaker with `payload` [kg] on it; absent where it is not known.

    Raises InvalidInput where an identified table does not cover the record's band.
    """
    target = shaking.target
    velocity, displacement = integrated(target.acceleration, target.sample_rate)
    found = {
        "displacement": float(np.abs(displacement).max()),
        "velocity": float(np.abs(velocity).max()),
        "acceleration": float(np.abs(target.acceleration).max()),
    }
    if (mover := configuration.mover) is not None:
        found |= _coil(target.acceleration, displacement, mover, configuration.limits, target.sample_rate)
    if response is not None:
        volts = _drive(shaking, payload, response)
        slew = float(np.abs(np.diff(volts)).max()) * target.sample_rate
        found |= {"drive_voltage": float(np.abs(volts).max()) + response.friction, "drive_slew": slew}
    return found


def _drive(shaking: Shaking, payload: float, response: TableResponse) -> Array:
    """Volts that make the record on a linear table."""
    target = shaking.target
    low, high = target.support
    frequency, spectrum = target.frequency, np.fft.rfft(target.acceleration)
    inside = (frequency > low) & (frequency < high)
    volts = np.zeros_like(spectrum)
    volts[inside] = spectrum[inside] / response.transfer(2.0 * np.pi * frequency[inside], payload)
    return np.fft.irfft(volts, target.acceleration.size)


def _coil(
    acceleration: Array, displacement: Array, mover: Mover, limits: Limits, sample_rate: float
) -> dict[str, float]:
    from scipy import signal

    force = mover.mass * acceleration
    current = (force + mover.stiffness * displacement) / mover.force_constant
    forget = float(np.exp(-1.0 / (limits.heating_time * sample_rate)))
    mean = np.asarray(signal.lfilter([1.0 - forget], [1.0, -forget], current**2))
    return {
        "force": float(np.abs(force).max()),
        "current": float(np.abs(current).max()),
        "heating": float(np.sqrt(mean.max())),
    }
