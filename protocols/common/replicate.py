"""Replication, a stage of several protocols: iterates the drive so that the table follows a motion."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from bench.control.passes import Pass
from bench.control.replication import Replication, ReplicationParameters, Status
from bench.control.table_model import TableModel
from bench.control.target import Target
from bench.document.typography import counted
from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, Publish, RampOut, Step
from bench.events import Event, StepStarted, Warned, event
from bench.guard.limits import Limits
from sim.parameters import column

Array = NDArray[np.float64]

STEP = 0.01
"""Time step of a `TableMotion` [s]."""

REST = 2.0
"""Time at rest before each pass, during which the signals are zeroed [s]."""


@event(table="passes", notice="pass")
class PassFinished(Event):
    """The end of pass `number` of a replication, the iteration that makes the table follow `motion`.

    `error`, `repeatable`, `peak_error` and `spectrum_error` are relative (see `bench.control.passes.Pass`); `text`
    summarises the pass.
    """

    time: float = column("s", "bench time at the end of the pass", default=nan, kw_only=True)
    motion: str = column("", "name of the motion that the table is to follow")
    number: int = column("1", "number of the pass, from 1 for each replication")
    error: float = column("1", "measured rms error relative to the rms of the target")
    repeatable: float = column("1", "error excluding its non-repeatable part")
    peak_error: float = column("1", "largest error relative to the peak of the target")
    spectrum_error: float = column("1", "largest relative deviation of the response spectrum")
    accepted: bool = column("1", "whether the error is the smallest so far; otherwise the previous drive is restored")
    text: str

    @property
    def line(self) -> str:
        return f"{self.motion}: {self.text}"


@event(journalled=False, eq=False)
class TableMotion(Event):
    """Accelerations of the table [m/s2], shape (n,): `achieved` in one `play` of a drive, and `target`, at the times
    `seconds` [s] from the start of the drive. For the live view only, since the file contains every sample.
    """

    motion: str
    play: str
    seconds: Array
    target: Array
    achieved: Array

    @property
    def line(self) -> str:
        return f"{self.motion}: {self.play}"


def table_motion(motion: str, play: str, target: Target, acceleration: Array) -> TableMotion:
    """The motion of one play, every `STEP` seconds; `acceleration` may extend beyond the target."""
    every = max(round(STEP * target.sample_rate), 1)
    wanted = target.acceleration[::every]
    seconds = every / target.sample_rate * np.arange(wanted.size, dtype=np.float64)
    return TableMotion(motion, play, seconds, wanted, acceleration[: target.acceleration.size : every])


Ending = Status | Literal["samples lost"]


@dataclass(frozen=True, eq=False)
class Replicated:
    """Result of a replication: the best `drive` [V] and its table acceleration [m/s2], both of the target's shape.

    `acceleration` was measured in the last accepted pass; None if there is none. `repeatable` is the relative rms error
    of the best drive, excluding noise (about 1 without a pass); `spectrum_error` is the largest deviation of the
    response spectrum that noise does not explain, with its period [s].

    `status` and `reason` describe how the passes ended. The status is "running" if the block `fell` before the end; the
    caller must then have it set upright.
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
    """Find the drive that makes the table follow `target`; `name` is the motion's name.

    The event from `progress` is published after each pass. A pass with missing samples of the table's sensors is
    repeated; after a second loss the best drive so far is returned. The rig must not be armed on entry, and is not
    armed on return. Raises InvalidInput if the model does not cover the target, or if the first drive exceeds a limit
    and scaling it is not allowed.
    """
    replication = Replication(target, model, limits, parameters)
    achieved: Array | None = None
    lost = 0
    while not replication.finished:
        yield Publish(StepStarted(f"{name}: pass {len(replication.passes) + 1} of at most {parameters.passes}"))
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
            yield Publish(Warned(f"{name}: samples of the table's motion are missing ({lost}); the pass is repeated"))
            continue
        report = replication.learn(moved[:, 0], moved[:, 1])
        if report.accepted:
            achieved = moved[:, 0]
        yield Publish(table_motion(name, f"pass {report.number}", target, moved[:, 0]))
        yield Publish(_finished(name, report))
        if progress is not None:
            yield Publish(progress())
        if fell:
            return _replicated(replication, achieved, fell=True)
    return _replicated(replication, achieved, fell=False)


def _replicated(replication: Replication, achieved: Array | None, *, fell: bool, lost: int = 0) -> Replicated:
    reasons: dict[Ending, str] = {
        "running": "the block fell",
        "converged": "the tolerances are met",
        "out of passes": f"the limit of {counted(replication.parameters.passes, 'pass', 'passes')} was reached",
        "limited": f"the next correction is not played: {replication.verdict}",
        "samples lost": f"samples of the table's motion were missing in both attempts at the pass ({lost} in the "
        "second)",
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
