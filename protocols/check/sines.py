"""Amplitudes of the sensors in the sines of a loop check, and the delays between them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from math import sqrt, tau
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2, SIGNALS
from bench.analysis.uncertainty import student_factor
from bench.config.model import BenchConfiguration
from drivers.timebase.common_motion import CommonMotion, common_motion
from protocols.check.held_readings import Delay, Windows, covariance, delay_without_age

Amplitudes = NDArray[np.complex128]

STOREY_SIGNALS = "storey_1", "storey_2"
"""Fields of `Sines` with the amplitudes of the lasers, in the order of STOREYS."""


@dataclass(frozen=True, eq=False)
class Sines:
    """Complex amplitudes c at `omega` [rad/s], shape (n,) each, with signal = Re(c exp(-i omega t)).

    With lasers on the ground, the four sensors measure a common motion. `drive` is in volts and `acceleration` in m/s2;
    all other amplitudes are displacements [m]. `accelerometer` is the displacement computed as acceleration / -omega^2.
    """

    omega: NDArray[np.float64]
    drive: Amplitudes
    acceleration: Amplitudes
    displacement: Amplitudes
    storey_1: Amplitudes
    storey_2: Amplitudes

    @property
    def accelerometer(self) -> Amplitudes:
        """Table displacement from the accelerometer [m]: x'' = -omega^2 x."""
        return -self.acceleration / self.omega**2

    def means(self) -> Self:
        """The mean amplitudes at each frequency, in increasing order."""
        omega, row = np.unique(self.omega, return_inverse=True)
        sums = {
            each.name: np.bincount(row, getattr(self, each.name).real)
            + 1j * np.bincount(row, getattr(self, each.name).imag)
            for each in fields(self)
            if each.name != "omega"
        }
        return type(self)(omega=omega, **{name: total / np.bincount(row) for name, total in sums.items()})


PARTS = 8
"""Most parts of a sine whose phases are evaluated separately."""


def divided(measured: Sequence[tuple[float, Sequence[Cycle]]], sample_rate: float) -> tuple[Sines, Windows]:
    """Amplitudes in successive parts of each sine, and the times of the parts, from pairs of frequency [rad/s] and
    cycles.
    """
    omegas, amplitudes = list[float](), list[NDArray[np.complex128]]()
    times = list[tuple[float, float]]()
    for omega, cycles in measured:
        ends = [len(cycles) * k // PARTS for k in range(PARTS + 1)]
        for part in (cycles[first:end] for first, end in pairwise(ends) if end > first):
            omegas.append(omega)
            amplitudes.append(np.mean([cycle.fundamental for cycle in part], axis=0))
            times.append((part[0].first / sample_rate, len(part) * tau / omega))
    columns, (begin, length) = np.array(amplitudes).T, np.array(times).T
    parts = Sines(
        omega=np.array(omegas),
        drive=columns[len(SIGNALS)],
        acceleration=columns[ACCELERATION],
        displacement=columns[DISPLACEMENT],
        storey_1=columns[LASER_1],
        storey_2=columns[LASER_2],
    )
    return parts, Windows(begin, length)


def delay_between(omega: NDArray[np.float64], first: Amplitudes, second: Amplitudes) -> CommonMotion:
    """Delay of the second signal against the first; its standard uncertainty follows Student's t, since the scatter of
    few phases about a line determines it only roughly.
    """
    # the amplitudes are for exp(-i omega t), those of `common_motion` for exp(+i omega t)
    found = common_motion(omega, first.conj(), second.conj())
    return replace(found, uncertainty=student_factor(omega.size) * found.uncertainty)


def held_for(configuration: BenchConfiguration) -> float:
    """Time [s] for which the readings of a laser are held. Those of serial lasers are placed at the times of their
    measurement.
    """
    serial = configuration.backend == "hardware" and configuration.hardware.lasers.connection == "serial"
    return 0.0 if serial else configuration.analysis.laser_timing


@dataclass(frozen=True)
class LaserDelays:
    """Delays [s] of both lasers against a sensor of the table, the means over all ages of held readings, and that of
    laser 2 against laser 1 with its standard uncertainty.
    """

    first: CommonMotion
    second: CommonMotion
    difference: float
    uncertainty: float


def laser_delays(parts: Sines, windows: Windows, table: str, timing: float, sample_rate: float) -> LaserDelays:
    """Delays of the lasers against the amplitudes `table` of `parts`, which were measured in `windows`.

    `timing` [s] is that of `held_for`, `sample_rate` is in Hz.
    """
    sines, omega = parts.means(), parts.omega
    first, second = (delay_between(sines.omega, getattr(sines, table), getattr(sines, name)) for name in STOREY_SIGNALS)
    if timing == 0.0:
        between = delay_between(sines.omega, sines.storey_1, sines.storey_2)
        return LaserDelays(first, second, between.delay, between.uncertainty)
    delays = list[Delay]()
    for found, name in zip((first, second), STOREY_SIGNALS, strict=True):
        turned = found.polarity * getattr(parts, name) / getattr(parts, table)
        seen = found.delay + np.angle(turned * np.exp(-1j * omega * found.delay)) / omega
        delays.append(delay_without_age(windows, seen, timing, sample_rate))
    one, other = delays
    # the noise of the table's sensor is in both
    variance = one.uncertainty**2 + other.uncertainty**2 - 2.0 * covariance(windows, one, other)
    return LaserDelays(
        replace(first, delay=one.value, uncertainty=one.uncertainty),
        replace(second, delay=other.value, uncertainty=other.uncertainty),
        other.value - one.value,
        sqrt(max(variance, 0.0)),
    )
