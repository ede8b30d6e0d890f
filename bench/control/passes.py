"""What a pass of a replication achieved."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.response_spectrum import DAMPING, logarithmic_periods, pseudo_acceleration
from bench.control.envelope import Verdict

Array = NDArray[np.float64]

CLEAR = 2.0
"""How many times what noise makes of it a deviation of the response spectrum must be to count."""


@dataclass(frozen=True)
class Pass:
    """One pass; errors are relative to the target [1], both seen through the target's window.

    `error` is the root mean square as measured; `floor` is the part of it that does not repeat: measurement noise,
    and after a drive was played twice all that differed. `repeatable` is what is left, and what a correction can take
    away. `peak_error` is the largest error over the target's peak, `spectrum_error` the largest deviation of the
    response spectrum. A pass is `accepted` when its error is the smallest so far; otherwise the drive goes back.
    `replayed` says that the best drive was played again; `gain` and `verdict` belong to the correction that led here.
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
        """Root mean square of the error without its floor."""
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
    """Compares response spectra with that of a target."""

    def __init__(
        self, target: Array, sample_rate: float, band: tuple[float, float], periods: tuple[float, ...]
    ) -> None:
        """`band` [s] and single `periods` [s] at which spectra are compared."""
        self._dt = 1.0 / sample_rate
        self._periods = np.concatenate((logarithmic_periods(*band), np.array(periods)))
        self._wanted = self._spectrum(target)

    def error(self, achieved: Array) -> float:
        """Largest relative deviation of the response spectrum."""
        return float(np.abs(self._spectrum(achieved) / self._wanted - 1.0).max())

    def clear_error(self, achieved: Array, frequency: Array, noise: Array) -> tuple[float, float]:
        """Largest relative deviation that noise does not explain, and its period [s]; zero where there is none.

        `noise`, shape (n_lines,), is the expected |numpy.fft.rfft|^2 of what does not repeat in `achieved`, at
        `frequency` [Hz], above zero. A peak is moved by about the noise of the oscillator's answer: a deviation of more
        than `CLEAR` times its standard deviation counts, and in full.
        """
        natural = 1.0 / self._periods[:, None]
        answer = natural**2 / np.abs(natural**2 - frequency**2 + 2j * DAMPING * natural * frequency)
        noisy = np.sqrt(2.0 * (answer**2 @ noise)) / achieved.size
        off = np.abs(self._spectrum(achieved) - self._wanted)
        deviation = np.where(off > CLEAR * noisy, off, 0.0) / self._wanted
        worst = int(deviation.argmax())
        return float(deviation[worst]), float(self._periods[worst])

    def _spectrum(self, acceleration: Array) -> Array:
        return pseudo_acceleration(acceleration, self._dt, self._periods, DAMPING)
