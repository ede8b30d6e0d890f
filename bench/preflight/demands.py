"""Response of the table to the drive, and demands of a sine programme on table, shaker and specimen."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import pi, tau
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.guard.shaker import ShakerModel, exponential_mean
from bench.preflight.margins import Demand, bounds
from bench.preflight.motion import laser_demands, peaks, table_demands
from sim.channel import STOREYS
from sim.excitation import SineProgram, Sweep
from sim.rocking import simulate
from sim.shaker import Shaker
from sim.specimen import Specimen

Array = NDArray[np.float64]


class TableResponse(Protocol):
    """Acceleration of the table per volt of drive."""

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:
        """Complex response [m/s2/V] at `omega` [rad/s], same shape, with `payload` [kg] on the table."""
        ...

    def gain(self, omega: Array, payload: float) -> Array:
        """Magnitude of `transfer` [m/s2/V], same shape."""
        ...

    @property
    def friction(self) -> float:
        """Additional drive [V] required to overcome friction: the fundamental of a force that changes sign with the
        velocity.
        """
        ...


@dataclass(frozen=True)
class SimulatedTable:
    """Shaker of the simulated bench: linear except for friction, with the payload as a rigid mass."""

    shaker: Shaker

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:
        return self.shaker.frequency_response(omega, payload)

    def gain(self, omega: Array, payload: float) -> Array:
        return np.abs(self.transfer(omega, payload))

    @property
    def friction(self) -> float:
        return 4.0 / pi * self.shaker.friction / self.shaker.force_per_volt


@dataclass(frozen=True)
class IdentifiedTable:
    """Response of an identified table, with the effects of the specimen and friction at the time of identification."""

    model: TableModel

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:  # noqa: ARG002
        return self.model.response(omega / tau)

    def gain(self, omega: Array, payload: float) -> Array:
        return np.abs(self.transfer(omega, payload))

    @property
    def friction(self) -> float:
        return 0.0


def response_of(configuration: BenchConfiguration) -> TableResponse | None:
    """Response of this bench's table; None for a real table without a stored model.

    Raises InvalidInput if the stored model cannot be read or was identified at another sample rate. Its age is not
    checked, because even an old model gives the approximate drive for a motion.
    """
    if configuration.table_model is not None:
        model = TableModel.read(Path(configuration.table_model))
        model.require_rate(configuration.sample_rate)
        return IdentifiedTable(model)
    if configuration.backend == "simulated":
        return SimulatedTable(configuration.simulation.bench.shaker)
    return None


STEP = 0.05
"""Time step of the envelope [s]."""


def envelope(program: SineProgram, times: Array) -> tuple[Array, Array, Array]:
    """Amplitude [m/s2], circular frequency [rad/s] and phase [rad] of `program` at `times` [s], same shape."""
    amplitude, omega, phase = (np.empty_like(times) for _ in range(3))
    turned = program.phase
    for sweep, here, since in _parts(program, times):
        amplitude[here], omega[here] = sweep.amplitude_at(since), sweep.omega_at(since)
        phase[here] = turned + sweep.phase_at(since)
        turned += float(sweep.phase_at(np.array(sweep.duration)))
    return amplitude, omega, phase


def _amplitude(program: SineProgram, times: Array) -> Array:
    """Amplitude [m/s2] of `program` at `times` [s], as in `envelope`."""
    found = np.empty_like(times)
    for sweep, here, since in _parts(program, times):
        found[here] = sweep.amplitude_at(since)
    return found


def _parts(program: SineProgram, times: Array) -> Iterator[tuple[Sweep, slice, Array]]:
    """Yield each sweep with its slice of the ascending `times` [s], and those times relative to the sweep's start. The
    last sweep includes all later times.
    """
    begins = [0.0, *accumulate(sweep.duration for sweep in program.sweeps)][: len(program.sweeps)]
    places = [*np.searchsorted(times, begins).tolist(), times.size]
    for sweep, begin, first, end in zip(program.sweeps, begins, places, places[1:], strict=False):
        yield sweep, slice(first, end), times[first:end] - begin


def load(
    program: SineProgram,
    begin: float,
    held: float,
    *,
    payload: float,
    shaker: ShakerModel | None,
    response: TableResponse | None,
    heating_time: float,
) -> dict[str, float]:
    """Largest value from `begin` [s] on of each quantity of table and shaker, by key; unknown quantities are absent.

    The last sine is held for `held` [s]. The heating, with time constant `heating_time` [s], is that of a programme
    that is repeated without pause, because the coil may be warm from previous programmes.
    """
    times = np.arange(0.0, program.duration, STEP)
    amplitude, omega, _ = envelope(program, times)
    counted = times >= begin
    a, w = amplitude[counted], omega[counted]
    found = peaks(table_demands(a / w**2, a / w, a, shaker))
    if shaker is not None:
        current = shaker.current_amplitude(amplitude, omega)
        found["current"] = float(np.max(current[counted]))
        found["heating"] = _heating(current, held, heating_time)
    if response is not None:
        drive = a / response.gain(w, payload) + response.friction * (a > 0.0)
        found |= {"drive_voltage": float(np.max(drive)), "drive_slew": float(np.max(drive * w))}
    return found


def _heating(current: Array, held: float, time: float) -> float:
    """Largest rms current [A], the root of the exponentially weighted mean of current^2 / 2, with the last amplitude
    held for `held` [s], after which the programme begins again.
    """
    power = 0.5 * current**2
    mean, _ = exponential_mean(power, float(np.exp(-STEP / time)))
    left = np.exp(-STEP / time * np.arange(1, power.size + 1))
    kept = float(np.exp(-held / time))
    end = float(power[-1]) + (float(mean[-1]) - float(power[-1])) * kept
    begin = end / -float(np.expm1(-(STEP * power.size + held) / time))
    return float(np.sqrt(max(float(np.max(mean + begin * left)), begin)))


PER_CYCLE = 32
"""Samples per cycle of the highest frequency of the programme; the peak of such a sine is underestimated by at most
0.5 %.
"""

TOLERANCE = 1e-7
"""Relative tolerance of the simulations."""


@dataclass(frozen=True)
class Travel:
    """Largest magnitudes of the displacement measured by each laser and of the drift [m]. `toppled` is the time [s] at
    which the block toppled; None if it did not topple, or if toppling was not evaluated.
    """

    storey_1: float
    storey_2: float
    drift: float
    toppled: float | None = None


def travel_demands(
    travels: Sequence[Travel], halves: tuple[float, float], off_middle: float
) -> dict[str, NDArray[np.float64]]:
    """Laser and drift demands of each specimen, shape (n,), as in `laser_demands`. At rest, the storeys are taken
    to be at a distance of `off_middle` times half the range from mid range.
    """
    moved = np.array([(each.storey_1, each.storey_2, each.drift) for each in travels]).T
    found = laser_demands(moved[0], moved[1], moved[2], halves)
    return {name: values + off_middle if name in STOREYS else values for name, values in found.items()}


def stage_travels(
    specimens: Sequence[Specimen],
    programs: Sequence[SineProgram],
    begin: float,
    reference: Literal["ground", "table"],
    catch_angle: float,
) -> list[Travel]:
    """Travels of each specimen under its programme, which starts from rest; evaluated from `begin` [s] until the end of
    the programme or the fall of the block.

    The programmes differ only in their amplitudes. `reference` states whether the lasers are mounted on the ground or
    the table. From `catch_angle` [rad] on, the block counts as fallen.
    """
    highest = max(max(sweep.omega) for sweep in programs[0].sweeps)
    times = np.arange(begin, programs[0].duration, tau / highest / PER_CYCLE)
    _, omega, phase = envelope(programs[0], times)
    squared, turn = omega**2, np.sin(phase)
    found: list[Travel] = []
    for specimen, program in zip(specimens, programs, strict=True):
        motion = simulate(
            specimen, program, sample_times=times, peaks_from=None, tolerance=TOLERANCE, overturning_angle=catch_angle
        )
        moved = np.zeros((0, 6)) if motion.samples is None else motion.samples
        n = len(moved)
        if not n:
            found.append(Travel(0.0, 0.0, 0.0))
            continue
        u1, u2 = moved[:, 0], moved[:, 1]
        table = -_amplitude(program, times[:n]) / squared[:n] * turn[:n] if reference == "ground" else np.zeros(n)
        found.append(Travel(*(float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1))))
    return found


LIKELY = 0.95
"""Quantile of the demands of the drawn specimens that is taken as the likely demand."""

UNKNOWN_SHAKER = {
    "force": "moving mass or force constant is unknown: set both moving_mass and force_constant",
    "current": "moving mass or force constant is unknown: set both moving_mass and force_constant",
    "heating": "moving mass or force constant is unknown: set both moving_mass and force_constant",
}
"""Reasons why demands on the shaker are not predicted, by quantity."""


UNPROBED = {
    "drive_voltage": "the table is unknown: the probes determine the drive within limits.drive_voltage",
    "drive_slew": "the table is unknown: the probes determine the drive within limits.drive_slew",
    **UNKNOWN_SHAKER,
}
"""Reasons why demands are not predicted for a table that the run itself probes, by quantity."""


def demands_of(known: Mapping[str, float], where: str, configuration: BenchConfiguration) -> tuple[Demand, ...]:
    """Demands on all limited quantities of a run that itself probes its table; `where` names the decisive part."""
    return tuple(
        Demand(quantity, known[quantity], None, where)
        if quantity in known
        else Demand(quantity, None, None, UNPROBED[quantity])
        for quantity in bounds(configuration)
    )


@dataclass(frozen=True, eq=False)
class StageDemands:
    """Demands of one part of a run, each of shape (1 + draws,): for the nominal specimen, then for the drawn ones.

    `chance` is the estimated probability that the block does not topple, where known.
    """

    name: str
    values: dict[str, NDArray[np.float64]]
    chance: float | None = None


def demand(quantity: str, asked: Sequence[StageDemands], unknown: Mapping[str, str]) -> Demand:
    """Largest demand on `quantity` among the parts of a run, or the reason in `unknown` if none is predicted."""
    known = [each for each in asked if quantity in each.values]
    if not known:
        return Demand(quantity, None, None, unknown[quantity])
    values = np.array([each.values[quantity] for each in known])
    where, most = int(values[:, 0].argmax()), values.max(axis=0)
    likely = max(float(np.quantile(most[1:], LIKELY)), float(most[0]))
    storey = f"storey {STOREYS.index(quantity) + 1} in " if quantity in STOREYS else ""
    return Demand(quantity, float(most[0]), likely, f"{storey}{known[where].name}")
