"""A stage of other protocols: play a drive again and again, each time corrected, until the table follows a motion."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from bench.control.passes import Pass
from bench.control.replication import Replication, ReplicationParameters, Status
from bench.control.table_model import TableModel
from bench.control.target import Target
from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, RampOut, Say, Step
from bench.events import Event, PassFinished, StepStarted, Warned
from bench.guard.limits import Limits

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each pass, over which the zero of the signals is taken [s]."""


Ending = Status | Literal["samples lost"]


@dataclass(frozen=True, eq=False)
class Replicated:
    """What a replication came to: the best `drive` [V] and its table acceleration [m/s2], both of the target's shape.

    `acceleration` is as measured in the pass that was accepted last; None where no pass was. `repeatable` is the root
    mean square error of the best drive without its noise, 1 where there is none; `spectrum_error` the largest deviation
    of the response spectrum that noise does not explain, and its period [s].

    `status` and `reason` say why no further pass was asked for; the status is "running" where the block `fell` before:
    it lies in its catch then, and is the caller's to stand up.
    """

    drive: Array
    acceleration: Array | None
    passes: tuple[Pass, ...]
    status: Ending
    reason: str
    fell: bool
    repeatable: float
    spectrum_error: tuple[float, float]


def replicate(
    target: Target,
    model: TableModel,
    limits: Limits,
    parameters: ReplicationParameters,
    name: str,
    progress: Callable[[], Event] | None = None,
) -> Generator[Step, Outcome, Replicated]:
    """Find the drive that makes the table follow `target`; `name` is what the motion is called.

    What `progress` returns is published after each pass. A pass in which the table's sensors lost samples is played
    once more; after the second loss the best drive so far is what there is.

    The rig is not armed before and after it. Raises InvalidInput when the model does not cover the target, or when
    the first drive is beyond a limit and is not to be scaled.
    """
    replication = Replication(target, model, limits, parameters)
    achieved: Array | None = None
    lost = 0
    while not replication.finished:
        yield Say(StepStarted(f"{name}: pass {len(replication.passes) + 1} of {parameters.passes} at most"))
        yield Arm(REST)
        outcome = yield Play(replication.drive)
        fell = isinstance((yield RampOut(fast=isinstance(outcome, Fallen))), Fallen)
        if not isinstance(outcome, Played):
            return _replicated(replication, achieved, fell=True)
        moved = outcome.signals[:, [ACCELERATION, DISPLACEMENT]]
        again, lost = lost > 0, int(np.count_nonzero(~np.isfinite(moved).all(axis=1)))
        if lost:
            if again or fell:
                return _replicated(replication, achieved, fell=fell, lost=lost)
            yield Say(Warned(f"{name}: {lost} samples of the table's motion are missing, the pass is repeated"))
            continue
        report = replication.learn(moved[:, 0], moved[:, 1])
        if report.accepted:
            achieved = moved[:, 0]
        yield Say(_finished(name, report))
        if progress is not None:
            yield Say(progress())
        if fell:
            return _replicated(replication, achieved, fell=True)
    return _replicated(replication, achieved, fell=False)


def _replicated(replication: Replication, achieved: Array | None, *, fell: bool, lost: int = 0) -> Replicated:
    reasons: dict[Ending, str] = {
        "running": "the block fell",
        "converged": "it is learned",
        "out of passes": f"no more than {replication.parameters.passes} passes are allowed",
        "limited": f"the next correction is not played: {replication.verdict}",
        "samples lost": f"{lost} samples of the table's motion were missing, and some when the pass was first played",
    }
    status: Ending = "samples lost" if lost and not fell else replication.status
    return Replicated(
        replication.best,
        achieved,
        replication.passes,
        status,
        reasons[status],
        fell,
        replication.repeatable,
        replication.spectrum_error,
    )


def _finished(name: str, report: Pass) -> PassFinished:
    return PassFinished(
        motion=name,
        number=report.number,
        error=report.error,
        repeatable=report.repeatable,
        peak_error=report.peak_error,
        spectrum_error=report.spectrum_error,
        accepted=report.accepted,
        text=str(report),
    )
