"""Identification of the frame from the signals of one or several decays."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.covariance import Errors, Uncertainty, fit_uncertainty
from bench.analysis.free_decay.damping import DampingCourse, damping_courses
from bench.analysis.free_decay.fit import NOISE, OFFSETS, Fit, fit_from_scratch
from bench.analysis.free_decay.response import OMEGA1, XI1, quantities
from bench.analysis.free_decay.stretch import Stretch, Unusable, stretch_of
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.uncertainty import enlarged, mean_of_repeats

Array = NDArray[np.float64]

LET_GO = 0.2
"""Time excluded after the start of a release [s], in which the operator's hand leaves the storey."""

SHORTEST = 2.0
"""Shortest recording of a decay [s] after that time."""

_HELD = 0.5
"""Time from the start of a recording during which the storey is assumed to be held [s]."""

_SLIPPED = 0.1
"""Fraction of a storey's largest displacement at which the storey counts as released."""

_NOT_EXPLAINED = 0.05
"""Largest root mean square of the residual of a decay, as a fraction of that of the motion; a damping that depends on
the amplitude leaves much less.
"""

_NOISY = 5.0 * NOISE
"""Root mean square of the residual [m] below which it may be noise."""


@dataclass(frozen=True, eq=False)
class Setting:
    """Known conditions of a recording: `sample_rate` [1/s], uncertainty of the `sensors`, whether the lasers are fixed
    to the table (`on_table`), the `masses` (m1, m2) [kg] and their covariance `masses_covariance` [kg2], shape (2, 2).
    """

    sample_rate: float
    sensors: SensorUncertainty
    on_table: bool
    masses: tuple[float, float]
    masses_covariance: Array


@dataclass(frozen=True, eq=False)
class Decay:
    """One decay: the `quantities` of `response.NAMES`, shape (8,), their uncertainty, the underlying fit, the damping
    of each mode against its amplitude, and the end of the excitation (`begin` [s]).

    `peak` [m] is the largest measured drift of storey 2 relative to storey 1, from rest.
    """

    quantities: Array
    uncertainty: Uncertainty
    fit: Fit
    courses: tuple[DampingCourse, DampingCourse]
    begin: float
    peak: float


def pulsed_decay(signals: Array, setting: Setting, quiet: float, begin: float) -> Decay:
    """Decay after a pulse of the table, from `signals` in the order of `bench.analysis.signals`.

    Table and frame are at rest until `quiet` [s], and the pulse ends at `begin` [s]. Raises Unusable if the fit fails.
    """
    seen = signals[:, [LASER_1, LASER_2]].T
    stretch = stretch_of(signals[:, DISPLACEMENT], seen, setting.sample_rate, on_table=setting.on_table)
    return _decay(stretch, setting, quiet, begin)


def released_decay(signals: Array, setting: Setting) -> Decay:
    """The decay of a frame that was held at the start of the recording and then released, with the table locked.

    Raises Unusable if the fit fails.
    """
    seen = signals[:, [LASER_1, LASER_2]].T
    # a locked table does not move: its sensor measures only noise
    stretch = stretch_of(np.zeros(len(signals)), seen, setting.sample_rate, on_table=setting.on_table)
    begin = _released(stretch) + LET_GO
    left = float(stretch.time[-1]) - begin
    if left < SHORTEST:
        raise Unusable(
            f"the storey was released {max(left, 0.0):.1f} s before the end of the recording: release it earlier"
        )
    found = _decay(stretch.from_time(begin), setting, 0.0, begin)
    # from rest, which the zero of a storey held by hand is not
    moved = found.fit.stretch.readings - found.fit.values[OFFSETS][:, None]
    return replace(found, peak=_largest_drift(moved))


def _decay(stretch: Stretch, setting: Setting, quiet: float, begin: float) -> Decay:
    fit = fit_from_scratch(stretch, setting.masses)
    _require_decay(fit)
    errors = Errors(setting.sensors, quiet, setting.masses_covariance)
    found = quantities(fit.constants)
    ratios, omegas = found[XI1 : XI1 + 2], found[OMEGA1 : OMEGA1 + 2]
    return Decay(
        quantities=found,
        uncertainty=fit_uncertainty(fit, errors),
        fit=fit,
        courses=damping_courses(fit, errors, begin, ratios, omegas),
        begin=begin,
        peak=_largest_drift(stretch.readings),
    )


def _largest_drift(readings: Array) -> float:
    return float(np.nanmax(np.abs(readings[1] - readings[0])))


def _require_decay(fit: Fit) -> None:
    """Raise Unusable if the fitted decay of two modes leaves too much of the motion, as after a push."""
    there = np.isfinite(fit.stretch.readings)
    moved = np.where(there, fit.stretch.readings - fit.values[OFFSETS][:, None], 0.0)
    left = float(np.sqrt(np.sum(fit.residual**2) / there.sum()))
    share = left / max(float(np.sqrt(np.sum(moved**2) / there.sum())), left)
    if left > _NOISY and share > _NOT_EXPLAINED:
        raise Unusable(
            f"the motion is not a free decay of the frame: the fit leaves {left * 1e3:.2g} mm rms, {100 * share:.0f} % "
            "of the motion; do not touch the frame after the release, and check that nothing else moves it"
        )


def _released(stretch: Stretch) -> float:
    """Time [s] at which storey 2 is released: its displacement first exceeds the fraction `_SLIPPED` of its maximum.
    Raises Unusable if there was no release.
    """
    seen = stretch.readings[1] - np.nanmedian(stretch.readings[1][stretch.time < _HELD])
    moved = np.nan_to_num(np.abs(seen))
    if moved.max() < 10.0 * np.nanstd(stretch.readings[1][stretch.time < _HELD]):
        raise Unusable(
            f"no release was found in the recording: hold the storey for the first {_HELD:g} s, then release it"
        )
    return float(stretch.time[np.argmax(moved > _SLIPPED * moved.max())])


@dataclass(frozen=True, eq=False)
class Combined:
    """Mean of R decays: `values`, shape (n,), and their covariance, shape (n, n), in two parts: from errors that are
    independent between decays (`own`) and from `common` errors.

    `birge` are the Birge ratios, shape (n,), NaN for a single decay; `weights`, shape (R, n), sum to 1; `scatter`,
    shape (n,), is the excess scatter of the decays as a standard uncertainty, included in `own`.
    """

    values: Array
    own: Array
    common: Array
    birge: Array
    weights: Array
    scatter: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the values, shape (n, n)."""
        return self.own + self.common


def combine(values: Sequence[Array], own: Sequence[Array], common: Sequence[Array]) -> Combined:
    """Combine R decays, each with `values`, shape (n,), and covariances, shape (n, n).

    Each quantity is the mean of the decays, weighted by their independent parts. Excess scatter enlarges the covariance
    (`bench.analysis.uncertainty`); a small scatter does not reduce it. The common part is added once.
    """
    found = mean_of_repeats(values, [np.diag(one) for one in own])
    inner = np.einsum("rn,rm,rnm->nm", found.weights, found.weights, np.array(own))
    shared = np.mean(common, axis=0)
    return Combined(found.values, enlarged(inner, found.scatter), shared, found.birge, found.weights, found.scatter)
