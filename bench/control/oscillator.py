"""Phase-continuous drive waveform: a sine with harmonics that make the table's motion sinusoidal.

The oscillator follows sweeps of target acceleration (`sim.excitation.Sweep`) and holds the last amplitude and frequency
until the next command. With the phase phi, requested amplitude A, shares c_k and calibrated response H, the drive is
sum over k of Im(A c_k / H(k omega) exp(i k phi)): a table that responds as calibrated has the acceleration A sin(phi)
for the shares (1, 0, 0, ...).
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.control.share_ramp import ShareRamp
from sim.excitation import SineProgram, Sweep


@dataclass(frozen=True)
class DriveCalibration:
    """Response of the table to the drive, `response` [m/s2 per V] at `omega` [rad/s], ascending, shape (n,).

    The response is complex, with the convention exp(+i omega t). It was measured and therefore includes the delay of
    the filter before the converter. Its real and imaginary parts are interpolated linearly between the points and are
    constant outside.
    """

    omega: tuple[float, ...]
    response: tuple[complex, ...]

    @staticmethod
    def flat(response: complex) -> "DriveCalibration":
        """A calibration with the same response at every frequency, as a starting point for measuring the response."""
        return DriveCalibration((1.0,), (response,))

    def at(self, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Response at `omega` [rad/s], same shape."""
        return np.asarray(np.interp(omega, self.omega, np.asarray(self.response, dtype=np.complex128)), np.complex128)

    def beyond(self, other: "DriveCalibration") -> "DriveCalibration":
        """This calibration, extended by the points of `other` above its last frequency."""
        above = [(omega, response) for omega, response in other.points if omega > self.omega[-1]]
        return DriveCalibration(
            (*self.omega, *(omega for omega, _ in above)), (*self.response, *(response for _, response in above))
        )

    @property
    def points(self) -> list[tuple[float, complex]]:
        """Pairs of frequency [rad/s] and response [m/s2 per V]."""
        return list(zip(self.omega, self.response, strict=True))


@dataclass(frozen=True)
class Segment:
    """Segment of a program that reaches the table acceleration `amplitude` [m/s2] at `omega` [rad/s] after `duration`
    [s].
    """

    duration: float
    amplitude: float
    omega: float


def sweeps(segments: Sequence[Segment], amplitude: float, omega: float) -> list[Sweep]:
    """The segments as sweeps, starting from `amplitude` and `omega`; from zero amplitude, a sweep begins at the
    frequency of its segment.
    """
    found: list[Sweep] = []
    for segment in segments:
        begin = omega if amplitude > 0.0 else segment.omega
        found.append(Sweep(segment.duration, (amplitude, segment.amplitude), (begin, segment.omega)))
        amplitude, omega = segment.amplitude, segment.omega
    return found


def program(segments: Sequence[Segment], phase: float = 0.0) -> SineProgram:
    """Base acceleration along the segments, starting from rest at `phase` [rad]."""
    return SineProgram(sweeps(segments, 0.0, segments[0].omega), phase)


Array = NDArray[np.float64]


_Factors = list[tuple[int, NDArray[np.complex128]]]
"""Orders of harmonics and their complex amplitudes [V]."""

_AHEAD = 8
"""Number of blocks of a held sine that are computed together, in half the time of single blocks."""


class Oscillator:
    """Converts target acceleration to drive voltage, block by block."""

    def __init__(self, sample_rate: float) -> None:
        self._rate = sample_rate
        self._calibration: DriveCalibration | None = None
        self._constant: tuple[object, _Factors] = (None, [])
        self.reset()

    def reset(self) -> None:
        """Reset to zero drive; keeps the calibration."""
        self._sweeps: deque[Sweep] = deque()
        self._into = 0  # number of samples of the first sweep already played
        self._amplitude, self._omega, self._phase = 0.0, tau, 0.0
        self._shares = ShareRamp()
        self._ahead: deque[Array] = deque()  # next blocks of the held sine, until a command changes it

    def use(self, calibration: DriveCalibration) -> None:
        """Use the response of `calibration` from the next sample on."""
        self._calibration = calibration
        self._ahead.clear()

    @property
    def amplitude(self) -> float:
        """Amplitude [m/s2] at the end of the last sweep."""
        return self._sweeps[-1].amplitude[1] if self._sweeps else self._amplitude

    @property
    def omega(self) -> float:
        """Circular frequency [rad/s] at the end of the last sweep."""
        return self._sweeps[-1].omega[1] if self._sweeps else self._omega

    def follow(self, sweep: Sweep) -> None:
        """Append a sweep; the harmonics of the previous sine fade out over one cycle."""
        self._shares.to_pure(self._cycle)
        self._sweeps.append(sweep)
        self._ahead.clear()

    def trim(self, shares: tuple[complex, ...], blend: float = 1.0, wait: int = 0) -> None:
        """Change to these `shares` of the fundamental, second harmonic and so on, within `blend` cycles of the current
        frequency, beginning after `wait` samples.
        """
        self._shares.to(shares, round(blend * self._cycle), wait)
        self._ahead.clear()

    @property
    def phase(self) -> float:
        """Phase [rad], 0 to 2 pi, at the last sample of a held sine; during a sweep, the phase at its beginning."""
        return self._phase

    @property
    def remaining(self) -> int:
        """Number of samples remaining until the end of the last sweep."""
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
        volts = self._drive(
            sweep.amplitude_at(t), sweep.omega_at(t), self._phase + sweep.phase_at(t), self._shares.next(n)
        )
        self._into += n
        if self._into == length:
            self._phase = (self._phase + float(sweep.phase_at(np.array(length / self._rate)))) % tau
            self._amplitude, self._omega = sweep.amplitude[1], sweep.omega[1]
            self._into = 0
            self._sweeps.popleft()
        return volts

    def _held(self, n: int) -> Array:
        if self._amplitude == 0.0:
            volts = np.zeros(n)
        else:
            blocks = _AHEAD if self._shares.constant else 1
            shares = self._shares.next(n)
            if not self._ahead or self._ahead[0].size != n:
                self._ahead = deque(self._held_blocks(blocks, n, shares))
            volts = self._ahead.popleft()
        self._phase = self._after(self._phase, n)
        return volts

    def _held_blocks(self, blocks: int, n: int, shares: NDArray[np.complex128]) -> Array:
        """The next samples of the held sine [V], shape (blocks, n); several blocks only with constant shares."""
        starts = [self._phase]
        while len(starts) < blocks:
            starts.append(self._after(starts[-1], n))
        phase: Array = np.add.outer(starts, self._omega / self._rate * np.arange(1, n + 1, dtype=np.float64))
        volts = self._drive(np.array(self._amplitude), np.array(self._omega), phase.ravel(), shares)
        return volts.reshape(blocks, n)

    def _after(self, phase: float, n: int) -> float:
        """Phase of the held sine [rad], `n` samples after `phase`."""
        return (phase + self._omega / self._rate * n) % tau

    def _drive(self, amplitude: Array, omega: Array, phase: Array, shares: NDArray[np.complex128]) -> Array:
        """Drive [V] at `phase` [rad], shape (n,); `amplitude` and `omega` have that shape or are scalars, and `shares`
        the shape (n, HARMONICS) or (1, HARMONICS).
        """
        if self._calibration is None:
            raise RuntimeError("the drive must be calibrated before the oscillator moves the table")
        power = turn = np.exp(1j * phase)
        volts, order = np.zeros(phase.size), 1
        for k, factor in self._factors(self._calibration, amplitude, omega, shares):
            for _ in range(k - order):
                power = power * turn
            order = k
            volts += (factor * power).imag
        return volts

    def _factors(
        self, calibration: DriveCalibration, amplitude: Array, omega: Array, shares: NDArray[np.complex128]
    ) -> _Factors:
        """Orders of the driven harmonics, ascending, and their complex amplitudes [V], shape (n,); computed once, with
        the shape (1,), where amplitude, frequency and shares are constant.
        """
        if amplitude.ndim or len(shares) > 1:
            key = None
        else:
            key = calibration, float(amplitude), float(omega), shares.tobytes()
            if key == self._constant[0]:
                return self._constant[1]
        driven = [int(k) + 1 for k in np.flatnonzero(np.abs(shares).max(axis=0))]
        found = [(k, amplitude * shares[:, k - 1] / calibration.at(k * omega)) for k in driven]
        self._constant = key, found
        return found
