"""Holds the table's acceleration at A sin(phi): amplitude and phase of the fundamental, harmonics cancelled.

Harmonic k of the table answers a change of the drive's share c_k with a gain g_k, 1 where the calibration holds, and
carries besides what friction and the block's impacts make. Whatever that is, it is taken out by

    c_k <- c_k + GAIN (r_k - y_k) / g_k,   r = (1, 0, 0, ...),

look by look, in bounded steps, with g_k corrected by the secant (y_k - y_k') / (c_k - c_k') of two looks wherever the
step between them stood out of the noise. c_k is what the drive was seen to play, not what it was told: a look that is
taken before the last step has gone through the rig asks for the same once more.
"""

from dataclasses import dataclass

import numpy as np

from bench.control.answer import Answer, Shares

GAIN = 0.9
"""Share of an error that one step removes: below 1 because a gain is never known exactly."""

PATIENCE = 6
"""Steps after which that share falls as 1, 1/2, 1/3 and so on: a motion that does not repeat from look to look is then
corrected in its mean instead of chased, which would change it."""

LARGEST_STEP = 0.10
"""Largest change of a share at one look."""

NOTICED = 1.5
"""How many of its standard deviations a harmonic must reach before it is corrected: what is less is noise."""

TELLING = 5.0
"""How many standard deviations a step must reach before its secant counts."""

PLAUSIBLE = (0.5, 2.0)
"""Magnitudes of a secant that can be a table's; a block that has not settled makes others."""


@dataclass(frozen=True)
class Tolerance:
    """What is left alone: relative error of the amplitude, error of the phase [rad], total harmonic distortion."""

    amplitude: float
    phase: float
    distortion: float

    def met(self, answer: Answer) -> bool:
        """Whether all three are within it."""
        return (
            abs(answer.amplitude_error) <= self.amplitude
            and abs(answer.phase_error) <= self.phase
            and answer.distortion <= self.distortion
        )


class SineControl:
    """Finds the next shares of the drive, look by look; harmonics above `highest` are left alone."""

    def __init__(self, highest: int, tolerance: Tolerance) -> None:
        self._highest = highest
        self._tolerance = tolerance
        self._gains = np.ones(highest, dtype=np.complex128)
        self._before: Answer | None = None
        self._steps = 0

    @property
    def gains(self) -> Shares:
        """What is known of the gains g_k, shape (highest,)."""
        return self._gains

    def next(self, answer: Answer) -> tuple[complex, ...] | None:
        """Shares to play next, or None where what was achieved is within the tolerance."""
        self._learn(answer)
        self._before = answer
        if self._tolerance.met(answer):
            return None
        played, achieved, doubt = (part[: self._highest] for part in (answer.played, answer.achieved, answer.doubt))
        error = -achieved
        error[0] += 1.0
        noticed = np.abs(error) > NOTICED * doubt
        noticed[0] = True
        self._steps += 1
        gain = GAIN / max(self._steps - PATIENCE, 1)
        step = np.where(noticed, gain * error / self._gains, 0.0)
        step *= LARGEST_STEP / np.maximum(np.abs(step), LARGEST_STEP)
        return tuple(complex(share) for share in played + step)

    def _learn(self, answer: Answer) -> None:
        """Correct the gains by what the last step did."""
        if self._before is None:
            return
        before, n = self._before, self._highest
        step, change = (answer.played - before.played)[:n], (answer.achieved - before.achieved)[:n]
        telling = np.abs(step) > TELLING * np.hypot(answer.doubt, before.doubt)[:n]
        secant = change / np.where(telling, step, 1.0)
        low, high = PLAUSIBLE
        self._gains = np.where(telling & (low < np.abs(secant)) & (np.abs(secant) < high), secant, self._gains)
