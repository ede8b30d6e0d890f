"""A stage of other protocols: play a drive again and again, each time corrected, until the table follows a motion."""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from bench.control.passes import Pass
from bench.control.replication import Replication, ReplicationParameters, Status
from bench.control.table_model import TableModel
from bench.control.target import Target
from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, RampOut, Say, Step
from bench.events import PassFinished, StepStarted
from bench.guard.limits import Limits

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each pass, over which the zero of the signals is taken [s]."""


@dataclass(frozen=True, eq=False)
class Replicated:
    """What a replication came to: the best `drive` [V] and its table acceleration [m/s2], both of the target's shape.

    `acceleration` is as measured in the pass that was accepted last; None where no pass was. `status` says why no
    further pass was asked for, and is "running" where the block `fell` before: it lies in its catch then, and is the
    caller's to stand up.
    """

    drive: Array
    acceleration: Array | None
    passes: tuple[Pass, ...]
    status: Status
    fell: bool


def replicate(
    target: Target, model: TableModel, limits: Limits, parameters: ReplicationParameters, name: str
) -> Generator[Step, Outcome, Replicated]:
    """Find the drive that makes the table follow `target`; `name` is what the motion is called.

    The rig is not armed before and after it. Raises InvalidInput when the model does not cover the target, or when
    the first drive is beyond a limit and is not to be scaled.
    """
    replication = Replication(target, model, limits, parameters)
    achieved: Array | None = None
    while not replication.finished:
        yield Say(StepStarted(0.0, f"{name}: pass {len(replication.passes) + 1} of {parameters.passes} at most"))
        yield Arm(REST)
        outcome = yield Play(replication.drive)
        fell = isinstance((yield RampOut(fast=isinstance(outcome, Fallen))), Fallen)
        if not isinstance(outcome, Played):
            return Replicated(replication.best, achieved, replication.passes, replication.status, True)
        acceleration = outcome.signals[:, ACCELERATION]
        report = replication.learn(acceleration, outcome.signals[:, DISPLACEMENT])
        if report.accepted:
            achieved = acceleration
        yield Say(_finished(name, report))
        if fell:
            return Replicated(replication.best, achieved, replication.passes, replication.status, True)
    return Replicated(replication.best, achieved, replication.passes, replication.status, False)


def _finished(name: str, report: Pass) -> PassFinished:
    return PassFinished(
        0.0,
        motion=name,
        number=report.number,
        error=report.error,
        repeatable=report.repeatable,
        peak_error=report.peak_error,
        spectrum_error=report.spectrum_error,
        accepted=report.accepted,
        text=str(report),
    )
