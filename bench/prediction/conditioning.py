"""Condition of a motion from rest: its sensitivity to its inputs, and the error of its computation.

A sine barely above the uplift acceleration can start a motion whose relative changes are millions of times those of the
inputs. The uncertainty of the inputs then limits the valid digits of the motion long before the integration does. The
condition number and the error of the computation are therefore both stated; times are rounded to their valid digits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor, inf, log10, nan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.ensemble import simulate_many
from sim.excitation import SampledRecord, SineProgram, Sweep
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


UNCERTAIN = Condition(nan, nan, nan)
"""Condition of a motion of which no digit is certain."""

PERIODIC = Condition(nan, nan, 0.0)
"""Condition of whole periods of a steady motion: not computed, since the requested end time is exact."""


def rounded_time(time: float, error: float) -> float:
    """`time` [s] rounded to the digits that its `error` [s] leaves valid; NaN if none is valid."""
    if not error < inf:
        return nan
    return time if error == 0.0 else round(time, floor(-log10(error))) or nan


def condition(coupled: Specimen, dwell: Sweep, times: ArrayLike, motion: Motion) -> Condition:
    """Condition of `motion`, which started from rest under the sine `dwell` and is sampled at `times` [s], shape (n,).

    `motion` may be that of any solver. Performs up to five runs at the tolerance FINE.
    """

    def fine(specimen: Specimen, amplitude: float) -> Motion:
        drive = SineProgram([Sweep.dwell(dwell.duration, amplitude, dwell.omega[0])])
        return simulate(specimen, drive, sample_times=times, peaks_from=None, tolerance=FINE)

    amplitude = dwell.amplitude[0]
    exact = fine(coupled, amplitude)
    if exact.status is not motion.status:
        return UNCERTAIN
    changed = [fine(coupled, (1.0 + CHANGE) * amplitude), *(fine(other, amplitude) for other in _changed(coupled))]
    number = max(_distance(exact, other) for other in changed) / CHANGE
    return Condition(number, _distance(exact, motion), _end_time_error(motion, exact, changed))


def end_time_errors(
    specimens: Sequence[Specimen], record: SampledRecord, motions: Sequence[Motion], scheduler: str | None = None
) -> list[float]:
    """Errors of the end times of `motions` [s], which started from rest under `record`; NaN for a motion that ends
    differently at the tolerance FINE. `scheduler` is that of `sim.sweep.sweep`.
    """
    if not motions:
        return []
    larger = SampledRecord((1.0 + CHANGE) * record.acceleration, record.dt)
    exact, changed = (
        simulate_many(specimens, drive, peaks_from=None, tolerance=FINE, scheduler=scheduler)
        for drive in (record, larger)
    )
    return [_end_time_error(*runs) for runs in zip(motions, exact, ([each] for each in changed), strict=True)]


def _end_time_error(motion: Motion, exact: Motion, changed: Sequence[Motion]) -> float:
    """Error of the end time [s] of `motion`: its difference from that of the run `exact` at the tolerance FINE, and the
    error of the latter. `changed` are runs with an input changed by CHANGE.
    """
    if exact.status is not motion.status:
        return nan
    shifts = [abs(each.end_time - exact.end_time) if each.status is exact.status else inf for each in changed]
    return abs(motion.end_time - exact.end_time) + FINE / CHANGE * max(shifts)


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
