"""Condition of a motion from rest: its sensitivity to its inputs, and the error of its computation.

A sine barely above the uplift acceleration can start a motion whose relative changes are millions of times those of the
inputs. The uncertainty of the inputs then limits the valid digits of the motion long before the integration does. The
condition number and the error of the computation are therefore both stated.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor, log10, nan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.excitation import SineProgram, Sweep
from sim.rocking import Motion, simulate
from sim.specimen import Specimen

CHANGE = 1e-11
"""Relative change of an input. The differences stay linear up to a condition number of about 1e9."""

FINE = 1e-15
"""Tolerance of the runs that are compared: 1e-4 of CHANGE."""


@dataclass(frozen=True)
class Condition:
    """Condition and accuracy of one motion.

    `number` is the greatest change of any state until the end, relative to the greatest magnitude of that state, per
    relative change of an input: amplitude, k1, k_C or restitution factor. `error` is the greatest difference
    from a run at the tolerance FINE, relative in the same way, and `end_time_error` [s] that of the end time. All are
    NaN if the two runs end differently, since no digit of such a motion is certain.
    """

    number: float
    error: float
    end_time_error: float

    def rounded_end(self, end_time: float) -> float:
        """`end_time` [s] rounded to the digits that its error leaves valid."""
        if not 0.0 < self.end_time_error < 1.0:
            return end_time
        return round(end_time, floor(-log10(self.end_time_error)))


UNKNOWN = Condition(nan, nan, nan)


def condition(coupled: Specimen, dwell: Sweep, times: ArrayLike, motion: Motion) -> Condition:
    """Condition of `motion`, which started from rest under the sine `dwell` and is sampled at `times` [s], shape (n,).

    Performs up to five runs at the tolerance FINE.
    """

    def fine(specimen: Specimen, amplitude: float) -> Motion:
        drive = SineProgram([Sweep.dwell(dwell.duration, amplitude, dwell.omega[0])])
        return simulate(specimen, drive, sample_times=times, peaks_from=None, tolerance=FINE)

    amplitude = dwell.amplitude[0]
    exact = fine(coupled, amplitude)
    if exact.status is not motion.status:
        return UNKNOWN
    changed = [fine(coupled, (1.0 + CHANGE) * amplitude), *(fine(other, amplitude) for other in _changed(coupled))]
    number = max(_distance(exact, other) for other in changed) / CHANGE
    return Condition(number, _distance(exact, motion), abs(motion.end_time - exact.end_time))


def _changed(coupled: Specimen) -> Iterator[Specimen]:
    """Yields the specimen with one input at a time changed by CHANGE; the restitution factor is reduced, as it cannot
    exceed 1.
    """
    larger, smaller = 1.0 + CHANGE, 1.0 - CHANGE
    block, frame = coupled.block, coupled.frame
    lower = block.model_copy(update={"restitution_factor": smaller * block.restitution_factor})
    yield coupled.model_copy(update={"block": lower})
    # at constant beta, the spring changes with the first storey
    yield coupled.model_copy(update={"frame": frame.model_copy(update={"k1": larger * frame.k1})})
    yield coupled.model_copy(update={"beta": larger * (coupled.beta or 0.0)})


def _distance(one: Motion, other: Motion) -> float:
    """Greatest difference between the samples of two motions, up to the end of the shorter one, relative to each
    state's greatest magnitude.
    """
    n = min(len(_samples(one)), len(_samples(other)))
    first, second = _samples(one)[:n], _samples(other)[:n]
    magnitude = np.abs(first).max(axis=0, initial=0.0)
    moving = magnitude > 0.0
    return float((np.abs(second - first)[:, moving] / magnitude[moving]).max(initial=0.0))


def _samples(motion: Motion) -> NDArray[np.float64]:
    assert motion.samples is not None
    return motion.samples
