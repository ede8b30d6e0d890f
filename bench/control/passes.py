"""Passes of a replication: errors relative to the target, and margins to the limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.analysis.response_spectrum import DAMPING, logarithmic_periods, pseudo_acceleration
from bench.control.target import integrated
from bench.guard.limits import Limits

Array = NDArray[np.float64]

UNITS = {"drive_voltage": "V", "drive_slew": "V/s", "displacement": "m", "velocity": "m/s", "acceleration": "m/s2"}


@dataclass(frozen=True)
class Envelope:
    """Motion and drive of one pass: a series, shape (n,), for each name of `UNITS`; the names are those of `Limits`."""

    series: Mapping[str, Array]

    @staticmethod
    def of(volts: Array, acceleration: Array, displacement: Array | None, sample_rate: float) -> "Envelope":
        """Envelope of a drive [V] and a table acceleration [m/s2], whose mean is removed before integration.

        `displacement` [m] is the measured displacement; without it the acceleration is integrated twice.
        """
        velocity, integral = integrated(acceleration, sample_rate)
        displacement = integral if displacement is None else displacement
        slew = np.diff(volts, prepend=0.0) * sample_rate
        return Envelope(dict(zip(UNITS, (volts, slew, displacement, velocity, acceleration), strict=True)))

    @property
    def peaks(self) -> dict[str, float]:
        """Largest magnitude of each series, in its unit."""
        return {name: float(np.abs(values).max()) for name, values in self.series.items()}


@dataclass(frozen=True)
class Verdict:
    """Fraction of a change that the limits allow, 0 to 1; if it is less than 1, `binds` names the limit that determines
    it, `demand` is the peak of this quantity with the whole change, and `allowed` the limit divided by the margin.
    """

    share: float
    binds: str | None
    demand: float
    allowed: float

    def __str__(self) -> str:
        if self.binds is None:
            return "within every limit"
        unit = UNITS[self.binds]
        return (
            f"{self.binds} of {self.demand:.4g} {unit} exceeds the allowed {self.allowed:.4g} {unit}, which is the "
            f"limit divided by the margin; {self.share:.1%} of the change is possible"
        )


def fitting(present: Envelope, change: Envelope, limits: Limits, margin: float) -> Verdict:
    """Largest fraction of `change` that, added to `present`, keeps all quantities within their limits divided by
    `margin`.
    """
    share, binds, wanted, allowed = 1.0, None, 0.0, 0.0
    for name in UNITS:
        base, step = present.series[name], change.series[name]
        limit = float(getattr(limits, name)) / margin
        # distance to the limit in the direction of the step; where it is zero, no part of the step is possible
        room = limit - np.sign(step) * base
        moving = np.abs(step) > 1e-12 * limit
        fits = float(np.min(room[moving] / np.abs(step[moving]), initial=np.inf))
        if fits < share:
            share, binds = max(fits, 0.0), name
            wanted, allowed = float(np.abs(base + step).max()), limit
    return Verdict(share, binds, wanted, allowed)


CLEAR = 2.0
"""Number of standard deviations due to noise above which a deviation of the response spectrum is significant."""


@dataclass(frozen=True)
class Pass:
    """A pass. Errors are relative to the target [1]; motion and target are both filtered by the target's window.

    `error` is the measured root mean square; `floor` is its non-repeatable part: measurement noise and, after a drive
    has been played twice, every difference between the two plays. `repeatable` is the remainder, which a correction can
    remove. `peak_error` is the largest error divided by the target's peak, `spectrum_error` the largest deviation of
    the response spectrum. A pass is `accepted` when its error is the smallest so far; otherwise the drive is rolled
    back. `replayed` states whether the pass played the best drive again; `gain` and `verdict` are those of the
    preceding correction.
    """

    number: int
    error: float
    floor: float
    peak_error: float
    spectrum_error: float
    accepted: bool
    replayed: bool
    gain: float
    verdict: Verdict

    @property
    def repeatable(self) -> float:
        """Relative root mean square of the error without its non-repeatable part, `floor`."""
        return max(self.error**2 - self.floor**2, 0.0) ** 0.5

    def __str__(self) -> str:
        kind = "replay" if self.replayed else f"gain {self.gain:.2g}"
        fate = "accepted" if self.accepted else "rolled back"
        limited = "" if self.verdict.binds is None else f"; {self.verdict}"
        return (
            f"pass {self.number} ({kind}): error {self.error:.2%}, repeatable {self.repeatable:.2%}, peak"
            f" {self.peak_error:.2%}, response spectrum {self.spectrum_error:.2%}, {fate}{limited}"
        )


class SpectrumCheck:
    """Comparison of response spectra with the spectrum of a target."""

    def __init__(
        self, target: Array, sample_rate: float, band: tuple[float, float], periods: tuple[float, ...]
    ) -> None:
        """The spectra are compared over the `band` of periods [s] and at single `periods` [s]."""
        self._dt = 1.0 / sample_rate
        self._periods = np.concatenate((logarithmic_periods(*band), np.array(periods)))
        self._target, self._last = target, (np.empty(0), np.empty(0))

    @cached_property
    def _target_spectrum(self) -> Array:
        # not needed for a drive that is refused
        return pseudo_acceleration(self._target, self._dt, self._periods, DAMPING)

    def error(self, achieved: Array) -> float:
        """Largest relative deviation of the response spectrum of `achieved` from that of the target."""
        return float(np.abs(self._spectrum(achieved) / self._target_spectrum - 1.0).max())

    def clear_error(self, achieved: Array, frequency: Array, noise: Array) -> tuple[float, float]:
        """Largest relative deviation not explained by noise, and its period [s]; a deviation of zero means none.

        `noise`, shape (n_lines,), is the expected |numpy.fft.rfft|^2 of the non-repeatable part of `achieved`, at
        `frequency` [Hz], above zero. Noise shifts a peak by about the noise of the oscillator's response; a deviation
        of more than `CLEAR` standard deviations of that noise counts in full, a smaller one is ignored.
        """
        natural = 1.0 / self._periods[:, None]
        answer = natural**2 / np.abs(natural**2 - frequency**2 + 2j * DAMPING * natural * frequency)
        noisy = np.sqrt(2.0 * (answer**2 @ noise)) / achieved.size
        off = np.abs(self._spectrum(achieved) - self._target_spectrum)
        deviation = np.where(off > CLEAR * noisy, off, 0.0) / self._target_spectrum
        worst = int(deviation.argmax())
        return float(deviation[worst]), float(self._periods[worst])

    def _spectrum(self, acceleration: Array) -> Array:
        # both errors of a pass, and those of the best drive, are asked for in turn; a caller may reuse its array
        if not np.array_equal(acceleration, self._last[0]):
            self._last = acceleration.copy(), pseudo_acceleration(acceleration, self._dt, self._periods, DAMPING)
        return self._last[1]
