"""From drive to motion: how many volts, and after what time."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.check_line import CheckLine, judged, stated
from bench.config.model import BenchConfiguration
from protocols.check.protocol import CheckParameters
from protocols.check.sines import Sines

_FINEST = 1e-5
"""Step of the dead times that are tried [s]."""


def drive_lines(sines: Sines, parameters: CheckParameters, configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """The dead time, and the drive for each frequency: judged where the shaker is known."""
    yield judged(
        "drive",
        "dead time to table_acceleration",
        dead_time(sines.omega, sines.drive, sines.acceleration, parameters.latency),
        (0.0, parameters.latency),
        "s",
        "inputs and output do not run on one clock from one trigger, or samples are lost: see hardware.daq",
    )
    expected = expected_drive(sines.omega, configuration)
    for place, omega in enumerate(sines.omega):
        what = f"volts per m/s2 at {omega:g} rad/s"
        measured = float(abs(sines.drive[place] / sines.acceleration[place]))
        if expected is None:
            yield stated("drive", what, measured, "V s2/m")
            continue
        usual, spread = float(expected[place]), parameters.drive_tolerance
        remedy = "see to the amplifier's gain, the moving mass, and the accelerometer's calibration"
        allowed = usual * (1.0 - spread), usual * (1.0 + spread)
        yield judged("drive", what, measured, allowed, "V s2/m", remedy, expected=usual)


def expected_drive(omega: NDArray[np.float64], configuration: BenchConfiguration) -> NDArray[np.float64] | None:
    """Drive per acceleration [V s2/m] of the simulated shaker, shape (n,); None for a real one, which is not known."""
    if configuration.backend != "simulated":
        return None
    frame = (configuration.simulation.specimen or configuration.specimen).frame
    response = configuration.simulation.bench.shaker.frequency_response(omega, frame.m1 + frame.m2)
    return 1.0 / np.abs(response)


def dead_time(
    omega: NDArray[np.float64], drive: NDArray[np.complex128], acceleration: NDArray[np.complex128], longest: float
) -> float:
    """Time [s] between drive and motion that mass, dashpot and spring do not explain, up to twice `longest` either way.

    drive / acceleration = (m + c / s + k / s^2) / G exp(s T) with s = i omega: for each T the three quotients follow
    by linear least squares, and the T that leaves least is taken. It holds the delay of the inputs' filters, of the
    amplifier, and half a sample.
    """
    # the cycles' amplitudes turn with exp(-i omega t)
    wanted = np.conj(drive / acceleration)
    s = 1j * omega
    basis = np.column_stack((s**0, 1.0 / s, 1.0 / s**2))
    tried = np.arange(-2.0 * longest, 2.0 * longest, _FINEST)
    left = [_residual((basis.T * np.exp(s * time)).T, wanted) for time in tried]
    return float(tried[int(np.argmin(left))])


def _residual(basis: NDArray[np.complexfloating], wanted: NDArray[np.complex128]) -> float:
    """Sum of squares, each relative to its value, that real coefficients leave."""
    weighed = basis / np.abs(wanted)[:, None]
    rows = np.concatenate((weighed.real, weighed.imag))
    aim = np.concatenate(((wanted / np.abs(wanted)).real, (wanted / np.abs(wanted)).imag))
    solution, *_ = np.linalg.lstsq(rows, aim, rcond=None)
    return float(np.sum((aim - rows @ solution) ** 2))
