"""Base excitation: sines whose amplitude and frequency change smoothly, and sampled records.

Every excitation is packed into one table of segments; no integration step of `sim.kernel` crosses a segment's end. In a
segment, with t counted from its start,

    a_g(t) = P(t) sin(phi_0 + omega_0 t + kappa t^2 / 2) + p_0 + p_1 t,   P a cubic polynomial.

A row is [duration, P_0, P_1, P_2, P_3, phi_0, omega_0, kappa, p_0, p_1].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import tau
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

ROW = 10
"""Number of values in a row of a packed excitation."""


class Excitation(Protocol):
    """Base acceleration of finite duration."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        ...

    def packed(self) -> NDArray[np.float64]:
        """Table of segments, shape (n, 10), as described in the module's docstring."""
        ...


@dataclass(frozen=True)
class Sweep:
    """A sine whose amplitude [m/s2] follows a cubic smoothstep and whose frequency [rad/s] changes linearly.

    `amplitude` and `omega` are (start, end); a dwell has equal ends.
    """

    duration: float
    amplitude: tuple[float, float]
    omega: tuple[float, float]

    @staticmethod
    def dwell(duration: float, amplitude: float, omega: float) -> "Sweep":
        """Return a sweep with constant amplitude and frequency."""
        return Sweep(duration, (amplitude, amplitude), (omega, omega))

    @property
    def chirp_rate(self) -> float:
        """kappa, change of the circular frequency per second [rad/s2]."""
        return (self.omega[1] - self.omega[0]) / self.duration

    def amplitude_at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Amplitude [m/s2] at the times `t` [s] since the start of the sweep; constant outside the sweep."""
        x = np.clip(t / self.duration, 0.0, 1.0)
        return self.amplitude[0] + (self.amplitude[1] - self.amplitude[0]) * x * x * (3.0 - 2.0 * x)

    def omega_at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Circular frequency [rad/s] at the times `t` [s] since the start of the sweep; constant outside the sweep."""
        x = np.clip(t / self.duration, 0.0, 1.0)
        return self.omega[0] + (self.omega[1] - self.omega[0]) * x

    def phase_at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Phase [rad] gained at the times `t` [s] since the start of the sweep; valid only within the sweep."""
        return self.omega[0] * t + 0.5 * self.chirp_rate * t * t

    def row(self, phase: float) -> list[float]:
        """Row of a packed excitation for this sweep, starting at `phase` [rad]."""
        rise, length = self.amplitude[1] - self.amplitude[0], self.duration
        polynomial = [self.amplitude[0], 0.0, 3.0 * rise / length**2, -2.0 * rise / length**3]
        return [length, *polynomial, phase, self.omega[0], self.chirp_rate, 0.0, 0.0]


class SineProgram:
    """Consecutive sweeps with a continuous phase, starting at `phase` [rad]."""

    def __init__(self, sweeps: Sequence[Sweep], phase: float = 0.0) -> None:
        for sweep in sweeps:
            if not sweep.duration > 0.0:
                raise InvalidInput("duration of a sweep", sweep.duration, "it must be a positive duration in s")
            if min(sweep.omega) <= 0.0:
                raise InvalidInput(
                    "omega of a sweep", min(sweep.omega), "both circular frequencies [rad/s] must be positive"
                )
        self.sweeps = tuple(sweeps)
        self.phase = phase

    @property
    def duration(self) -> float:
        return sum(sweep.duration for sweep in self.sweeps)

    def packed(self) -> NDArray[np.float64]:
        rows: list[list[float]] = []
        phase = self.phase
        for sweep in self.sweeps:
            rows.append(sweep.row(phase))
            phase = (phase + float(sweep.phase_at(np.array(sweep.duration)))) % tau
        return np.array(rows, dtype=np.float64).reshape(-1, ROW)


class SampledRecord:
    """Accelerations [m/s2] at a constant time step `dt` [s], interpolated linearly between the samples."""

    def __init__(self, acceleration: NDArray[np.float64], dt: float) -> None:
        if not dt > 0.0:
            raise InvalidInput("dt of a record", dt, "it must be a positive time step in s")
        if acceleration.ndim != 1 or acceleration.size < 2 or not np.isfinite(acceleration).all():
            raise InvalidInput(
                "record", acceleration.shape, "it must be one-dimensional, with at least two samples, all finite"
            )
        self.acceleration = acceleration
        self.dt = dt

    @property
    def duration(self) -> float:
        return (self.acceleration.size - 1) * self.dt

    def packed(self) -> NDArray[np.float64]:
        rows = np.zeros((self.acceleration.size - 1, ROW))
        rows[:, 0] = self.dt
        rows[:, 8] = self.acceleration[:-1]
        rows[:, 9] = np.diff(self.acceleration) / self.dt
        return rows
