"""Main numbers of the paper's seven records, and what makes a synthetic motion have them.

Peaks, durations and bands of six were measured on the records themselves. Parkfield's peak is that of its database,
its pulse, ten inches of displacement within one and a half seconds, that of Housner and Trifunac (Bull. Seism. Soc.
Am. 57, 1967); its duration and band are estimates. The periods and amplitudes of the other pulses are our choice,
near the velocity pulses that the records show by eye; they were not fitted. Frequencies of the filters and durations
of the noise were found so that the mean over seeds has the declared numbers.
"""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Pulse:
    """Velocity pulse near a fault: period [s], amplitude [m/s], number of half cycles gamma, phase nu [rad]."""

    period: float
    velocity: float
    gamma: float = 2.0
    phase: float = 0.0


@dataclass(frozen=True)
class Shape:
    """`peak` [g]; `duration` [s] between 5 and 95 % of the Arias intensity; `band` [Hz] that holds the middle 68 % of
    the acceleration's energy. `ground`: frequency and damping ratio of the ground and frequency of the high-pass;
    `significant` [s]: duration of the noise alone.
    """

    peak: float
    duration: float
    band: tuple[float, float]
    ground: tuple[float, float, float]
    significant: float
    pulse: Pulse | None = None


SHAPES: dict[str, Shape] = {
    "pacoima": Shape(1.219, 7.0, (1.0, 7.1), (1.93, 0.78, 0.73), 7.2, Pulse(1.5, 0.9)),
    "parkfield": Shape(0.476, 7.0, (0.6, 3.5), (1.6, 0.6, 0.15), 7.6, Pulse(1.5, 0.6, phase=0.5 * pi)),
    "erzincan": Shape(0.515, 7.5, (0.4, 2.4), (0.46, 0.9, 0.26), 7.7, Pulse(2.2, 0.6)),
    "el-centro": Shape(0.313, 24.1, (1.15, 6.0), (1.32, 0.78, 0.89), 24.2),
    "l-aquila": Shape(0.664, 8.6, (1.8, 9.4), (3.24, 0.63, 0.74), 8.6),
    "newhall": Shape(0.590, 5.5, (0.85, 3.7), (1.65, 0.54, 0.39), 5.7, Pulse(1.0, 0.4)),
    "kobe": Shape(0.697, 4.6, (0.63, 3.7), (1.3, 0.6, 0.25), 4.8, Pulse(1.4, 0.5)),
}

NAMES = tuple(SHAPES)
"""In the paper's order."""
