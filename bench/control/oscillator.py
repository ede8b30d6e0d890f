"""The phase-continuous waveform that drives the table: a sine, and the harmonics that make its motion one.

It follows sweeps of target acceleration (`sim.excitation.Sweep`) and holds the last amplitude and frequency until told
otherwise. With its phase phi, the amplitude A asked, shares c_k and the calibrated response H, the drive is

    sum over k of Im(A c_k / H(k omega) exp(i k phi)):

a table that answers as calibrated moves with the acceleration A sin(phi) when the shares are (1, 0, 0, ...).
"""

from collections import deque
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS
from bench.control.calibration import DriveCalibration
from sim.excitation import Sweep

Array = NDArray[np.float64]


class Glide:
    """Share k belongs to harmonic k + 1. They begin as a pure sine, (1, 0, 0, ...), and change along a smoothstep."""

    def __init__(self) -> None:
        self._from = self._to = _pure()
        self._length, self._done = 1, 1

    def to(self, shares: tuple[complex, ...], samples: int) -> None:
        """Be at `shares` after `samples` more samples; harmonics that are not named go to zero."""
        target = np.zeros(HARMONICS, dtype=np.complex128)
        target[: len(shares)] = shares
        self._from, self._to = self._at(np.array([self._done]))[0], target
        self._length, self._done = max(samples, 1), 0

    def to_pure(self, samples: int) -> None:
        """Be a pure sine after `samples` more samples."""
        if not np.array_equal(self._to, _pure()):
            self.to((1.0,), samples)

    def next(self, n: int) -> NDArray[np.complex128]:
        """Shares at the next `n` samples, shape (n, HARMONICS), or (1, HARMONICS) while they rest."""
        if self._done >= self._length:
            return self._to[None, :]
        found = self._at(self._done + np.arange(1, n + 1))
        self._done += n
        return found

    def _at(self, done: NDArray[np.int_]) -> NDArray[np.complex128]:
        x = np.minimum(done / self._length, 1.0)[:, None]
        return self._from + (self._to - self._from) * (x * x * (3.0 - 2.0 * x))


def _pure() -> NDArray[np.complex128]:
    shares = np.zeros(HARMONICS, dtype=np.complex128)
    shares[0] = 1.0
    return shares


class Oscillator:
    """Turns target acceleration into volts, block by block."""

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._calibration: DriveCalibration | None = None
        self.reset()

    def reset(self) -> None:
        """Back to silence; the calibration stays."""
        self._sweeps: deque[Sweep] = deque()
        self._into = 0  # samples played of the first sweep
        self._amplitude, self._omega, self._phase = 0.0, tau, 0.0
        self._shares = Glide()

    def use(self, calibration: DriveCalibration) -> None:
        """Divide by the response of `calibration` from now on."""
        self._calibration = calibration

    @property
    def amplitude(self) -> float:
        """Amplitude [m/s2] at the end of what has been asked."""
        return self._sweeps[-1].amplitude[1] if self._sweeps else self._amplitude

    @property
    def omega(self) -> float:
        """Circular frequency [rad/s] at the end of what has been asked."""
        return self._sweeps[-1].omega[1] if self._sweeps else self._omega

    def follow(self, sweep: Sweep) -> None:
        """Append a sweep; shares found for the sine that is left are given up over one cycle."""
        self._shares.to_pure(self._cycle)
        self._sweeps.append(sweep)

    def trim(self, shares: tuple[complex, ...]) -> None:
        """Go to `shares` of fundamental, second harmonic and so on, over one cycle of the present frequency."""
        self._shares.to(shares, self._cycle)

    @property
    def remaining(self) -> int:
        """Samples until the last sweep has been played."""
        return sum(self._length(sweep) for sweep in self._sweeps) - self._into

    def next(self, n: int) -> Array:
        """The next `n` samples of drive [V], shape (n,)."""
        pieces: list[Array] = []
        while n > 0:
            piece = self._from_sweep(n) if self._sweeps else self._held(n)
            pieces.append(piece)
            n -= piece.size
        return pieces[0] if len(pieces) == 1 else np.concatenate(pieces)

    @property
    def _cycle(self) -> int:
        return max(round(tau / self._omega * self._rate), 1)

    def _length(self, sweep: Sweep) -> int:
        return max(round(sweep.duration * self._rate), 1)

    def _from_sweep(self, n: int) -> Array:
        sweep = self._sweeps[0]
        length = self._length(sweep)
        n = min(n, length - self._into)
        t = np.arange(self._into + 1, self._into + n + 1) / self._rate
        volts = self._drive(sweep.amplitude_at(t), sweep.omega_at(t), self._phase + sweep.phase_at(t))
        self._into += n
        if self._into == length:
            self._phase = (self._phase + float(sweep.phase_at(np.array(length / self._rate)))) % tau
            self._amplitude, self._omega = sweep.amplitude[1], sweep.omega[1]
            self._into = 0
            self._sweeps.popleft()
        return volts

    def _held(self, n: int) -> Array:
        step = self._omega / self._rate
        phase: Array = self._phase + step * np.arange(1, n + 1, dtype=np.float64)
        self._phase = (self._phase + step * n) % tau
        if self._amplitude == 0.0:
            return np.zeros(n)
        return self._drive(np.array(self._amplitude), np.array(self._omega), phase)

    def _drive(self, amplitude: Array, omega: Array, phase: Array) -> Array:
        """Drive [V] at `phase` [rad], shape (n,); `amplitude` and `omega` have that shape or none."""
        if self._calibration is None:
            raise RuntimeError("the oscillator was asked to move the table before the drive was calibrated")
        shares = self._shares.next(phase.size)
        turn = np.exp(1j * phase)
        power, volts = np.ones_like(turn), np.zeros(phase.size)
        for k, share in enumerate(shares.T, 1):
            power = power * turn
            if share.any():
                volts += np.imag(amplitude * share / self._calibration.at(k * omega) * power)
        return volts
