"""From the signals of one decay to what it tells of the frame, and how surely."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.damping import DampingCourse, damping_courses
from bench.analysis.free_decay.doubt import Doubt, Errors, doubt
from bench.analysis.free_decay.fit import Fit, fit_from_scratch
from bench.analysis.free_decay.modal import OMEGA1, XI1, quantities
from bench.analysis.free_decay.stretch import Stretch, Unusable, stretch_of
from bench.analysis.gain import SensorAccuracy
from bench.analysis.signals import DISPLACEMENT, LASER_1, LASER_2

Array = NDArray[np.float64]

LET_GO = 0.2
"""Time after the first sign of a release that is left out: the hand leaves the storey [s]."""

_HELD = 0.5
"""Time at the start of a recording in which the storey is surely held [s]."""

_SLIPPED = 0.1
"""Share of its later motion by which a storey leaves the hand when it is let go."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What is known beforehand: `sample_rate` [1/s], the lasers' `ranges` [m] and whether they ride `on_table`, their
    `accuracy`, the `masses` (m1, m2) [kg] and their covariance `weighed` [kg2], shape (2, 2).
    """

    sample_rate: float
    ranges: tuple[float, float]
    on_table: bool
    accuracy: SensorAccuracy
    masses: tuple[float, float]
    weighed: Array


@dataclass(frozen=True, eq=False)
class Decay:
    """One decay: the `quantities` of `modal.NAMES`, shape (8,), their doubt, the fit behind them, how the damping of
    either mode goes with its amplitude, and when the excitation was over (`begin` [s]).

    `peak` [m] is the largest drift.
    """

    quantities: Array
    doubt: Doubt
    fit: Fit
    courses: tuple[DampingCourse, DampingCourse]
    begin: float
    peak: float


def pulsed_decay(signals: Array, setting: Setting, quiet: float, begin: float) -> Decay:
    """The decay after a pulse of the table, from `signals` as `bench.analysis.signals` numbers them.

    All is at rest until `quiet` [s], and the pulse is over at `begin`. Raises Unusable when it tells nothing.
    """
    seen = signals[:, [LASER_1, LASER_2]].T
    stretch = stretch_of(signals[:, DISPLACEMENT], seen, setting.sample_rate, on_table=setting.on_table)
    return _decay(stretch, setting, quiet, begin)


def released_decay(signals: Array, setting: Setting) -> Decay:
    """The decay of a frame that was let go on a locked table some time after the start of the recording.

    Raises Unusable when it tells nothing.
    """
    seen = signals[:, [LASER_1, LASER_2]].T
    # a locked table does not move: what its sensor shows is noise
    stretch = stretch_of(np.zeros(len(signals)), seen, setting.sample_rate, on_table=setting.on_table)
    begin = _released(stretch) + LET_GO
    return _decay(stretch.from_time(begin), setting, 0.0, begin)


def _decay(stretch: Stretch, setting: Setting, quiet: float, begin: float) -> Decay:
    fit = fit_from_scratch(stretch, setting.masses)
    errors = Errors(setting.accuracy, setting.ranges, quiet, setting.weighed)
    found = quantities(fit.constants)
    ratios, omegas = found[XI1 : XI1 + 2], found[OMEGA1 : OMEGA1 + 2]
    return Decay(
        quantities=found,
        doubt=doubt(fit, errors),
        fit=fit,
        courses=damping_courses(fit, errors, begin, ratios, omegas),
        begin=begin,
        peak=float(np.nanmax(np.abs(stretch.seen[1] - stretch.seen[0]))),
    )


def _released(stretch: Stretch) -> float:
    """When storey 2 left its place [s]: by a share of its later motion. Raises Unusable when it did not."""
    seen = stretch.seen[1] - np.nanmedian(stretch.seen[1][stretch.time < _HELD])
    moved = np.nan_to_num(np.abs(seen))
    if moved.max() < 10.0 * np.nanstd(stretch.seen[1][stretch.time < _HELD]):
        raise Unusable("the frame was not let go while it was recorded: let go sooner, or listen for longer")
    return float(stretch.time[np.argmax(moved > _SLIPPED * moved.max())])
