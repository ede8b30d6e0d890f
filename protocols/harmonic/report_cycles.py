# pyright: reportUnknownMemberType=false
"""Measured cycles of harmonic points from the raw channels, and their figure in the style of Fig. 5 of the paper."""

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import tau
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT, SIGNALS, U1, SignalMap
from bench.datafile.reader import DataFile
from bench.datafile.resting import rows_at_rest
from bench.document.campaign import Campaign
from bench.figures.style import (
    BLACK,
    BLUE,
    GREY,
    MILLI,
    ORANGE,
    SKY,
    VERMILLION,
    add_legend,
    centre,
    new_figure,
    set_grid,
)
from bench.live_values import Estimate
from protocols.common.sine.calibration import REST
from sim.gain import Branch

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

PERIODS, SAMPLES = 3, 120
"""Number of periods of the drive that are drawn, and number of points per curve and period."""

BOUNDARIES = ("StepStarted", "StateChanged")
"""Events that end a dwell."""


WIDTH, ROW, MARGIN = 9.0, 1.95, 0.9
"""Width of the figure, height of a row, and space for titles and legend [inches]."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """Steady motion of the model at the same times: drift [m], u1 [m], theta [rad], each of shape (n,)."""

    drift: Floats
    u1: Floats
    theta: Floats


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """Measured cycles of a point; `time` [s], shape (n,), starts at an upward zero crossing of the fundamental of the
    table acceleration.

    `drift`, `bare_drift` and `u1` [m], shape (n,), are NaN where samples are missing; `bare_drift` is the drift of the
    bare frame at the same phase, None if it is not found. `predicted` is None if the model has no such motion.
    """

    omega: float
    beta: float
    status: str
    time: Floats
    drift: Floats
    u1: Floats
    bare_drift: Floats | None
    predicted: Predicted | None


@dataclass(frozen=True, eq=False)
class Cycles:
    """Periods of one test from an upward zero crossing of the fundamental of the table acceleration on: drift and u1
    [m], shape (n,) each, NaN for lost samples.
    """

    drift: Floats
    u1: Floats


class Dwells:
    """Measured cycles of a harmonic campaign, from the raw channels of its data file."""

    def __init__(self, campaign: Campaign, signals: SignalMap) -> None:
        self._record, self._signals = campaign.record, signals
        self._blocks = self._record.blocks
        self._ends = _ends_of_dwells(self._record)

    def motion(self, point: Mapping[str, Any], branch: Branch | None) -> MeasuredMotion | None:
        """Last measured cycles of a point; None if the file lacks them. `branch` is the predicted motion."""
        omega, beta = float(point["omega_rad_s"]), float(point["beta"])
        found = self._cycles(omega, beta, point.get("drift_peak_m"))
        if found is None:
            return None
        bare = self._cycles(omega, None, point.get("bare_drift_peak_m"))
        return MeasuredMotion(
            omega=omega,
            beta=beta,
            status=f"measured: {point['status']}",
            time=np.arange(PERIODS * SAMPLES, dtype=np.float64) * (tau / omega / SAMPLES),
            drift=found.drift,
            u1=found.u1,
            bare_drift=None if bare is None else bare.drift,
            predicted=None if branch is None else _predicted(branch),
        )

    def _cycles(self, omega: float, beta: float | None, peak: float | None) -> Cycles | None:
        """Cycles of the attempt whose peak drift is closest to the point's."""
        tries = [self._last_cycles(end, omega) for end in self._ends.get((omega, beta), ())]
        whole = [each for each in tries if each is not None]
        if peak is None or not whole:
            return None
        return min(whole, key=lambda each: abs(float(np.nanmax(np.abs(each.drift))) - peak))

    def _last_cycles(self, end: float, omega: float) -> Cycles | None:
        """Last complete periods before `end` [s of bench time]; None if there are none."""
        block = bisect_right(self._blocks["time"], end + 1e-6) - 1
        if block < 0:
            return None
        rows, runs = self._blocks["row"], self._blocks["run"]
        stop = int(rows[block + 1]) if block + 1 < rows.size else self._record.rows
        start = int(rows[bisect_left(runs, runs[block])])
        period = tau / omega * self._record.sample_rate
        begin = stop - round((PERIODS + 1) * period)
        still = rows_at_rest(self._record, start, REST)
        if begin <= still.stop or still.start == still.stop:
            return None
        self._signals.tare(self._values(still.start, still.stop))
        return _in_phase(self._signals.of(self._values(begin, stop)), period)

    def _values(self, start: int, stop: int) -> Floats:
        channels = self._record.channels
        return np.column_stack([self._record.values(channel.name, slice(start, stop)) for channel in channels])


def measured_figure(motions: Sequence[MeasuredMotion]) -> "Figure":
    """Figure with a row of two panels for each point."""
    figure = new_figure(WIDTH, len(motions) * ROW + MARGIN)
    panels: list[Axes] = []
    for k, motion in enumerate(motions):
        left = figure.add_subplot(len(motions), 2, 2 * k + 1)
        right = figure.add_subplot(len(motions), 2, 2 * k + 2)
        _draw_drift(left, motion)
        panels += [left, *_draw_storey(right, motion)]
        left.set_title(
            rf"({chr(ord('a') + k)})  $\Omega$ = {motion.omega:g} rad/s,  $\beta$ = {motion.beta:g}",
            loc="left",
            fontsize=9,
        )
        right.set_title(motion.status, loc="right", fontsize=9)
        for panel in (left, right):
            panel.set_xlim(float(motion.time[0]), float(motion.time[-1]))
            set_grid(panel)
            if k == len(motions) - 1:
                panel.set_xlabel(r"$t$  [s]")
    add_legend(figure, panels, 3)
    return figure


def _ends_of_dwells(record: DataFile) -> dict[tuple[float, float | None], list[float]]:
    """Ends [s of bench time] of the dwells by frequency [rad/s] and stiffness ratio (None for the bare frame).

    The running estimates identify the test; the dwell with the result follows the last estimate.
    """
    changes = [event.time for event in record.events if event.kind in BOUNDARIES]
    estimates = record.columns_of(Estimate)
    ends: dict[tuple[float, float | None], list[float]] = {}
    for time, omega, beta in zip(estimates["time"], estimates["omega"], estimates["beta"], strict=True):
        after = bisect_right(changes, time)
        if after < len(changes):
            of = ends.setdefault((float(omega), None if beta is None else float(beta)), [])
            if changes[after] not in of:
                of.append(changes[after])
    return ends


def _in_phase(signals: Floats, period: float) -> Cycles | None:
    """Means over short, equal parts of the period, starting at the first upward zero crossing of the fundamental of the
    table acceleration; None if more than half of the acceleration samples are missing.
    """
    acceleration = signals[:, ACCELERATION]
    known = np.isfinite(acceleration)
    if known.mean() < 0.5:
        return None
    place = np.arange(len(signals), dtype=np.float64)
    angle = tau / period * place
    waves = np.column_stack([np.sin(angle), np.cos(angle), np.ones(angle.size)])
    sine, cosine, _ = np.linalg.lstsq(waves[known], acceleration[known], rcond=None)[0]
    first = float(-np.arctan2(cosine, sine) % tau) / tau * period
    part = np.floor((place - first) / period * SAMPLES + 0.5).astype(np.int64)
    used = (part >= 0) & (part < PERIODS * SAMPLES)
    means = np.full((PERIODS * SAMPLES, len(SIGNALS)), np.nan)
    for column in (DRIFT, U1):
        good = used & np.isfinite(signals[:, column])
        count = np.bincount(part[good], minlength=PERIODS * SAMPLES)
        total = np.bincount(part[good], weights=signals[good, column], minlength=PERIODS * SAMPLES)
        np.divide(total, count, out=means[:, column], where=count > 0)
    return Cycles(drift=means[:, DRIFT], u1=means[:, U1])


def _predicted(branch: Branch) -> Predicted:
    u1, u2, theta = np.tile(branch.orbit.samples(SAMPLES)[:, 1:], (PERIODS, 1)).T
    return Predicted(drift=u2 - u1, u1=u1, theta=theta)


def _draw_drift(panel: "Axes", motion: MeasuredMotion) -> None:
    shown = [MILLI * motion.drift]
    if motion.bare_drift is not None:
        shown.append(MILLI * motion.bare_drift)
        panel.plot(motion.time, shown[-1], color=GREY, linewidth=0.9, linestyle="--", label="bare drift, measured")
    panel.plot(motion.time, shown[0], color=BLUE, linewidth=1.7, label="drift, measured")
    if motion.predicted is not None:
        shown.append(MILLI * motion.predicted.drift)
        panel.plot(
            motion.time, shown[-1], color=ORANGE, linewidth=1.1, linestyle=(0, (2, 1.5)), label="drift, predicted"
        )
    centre(panel, *shown)
    panel.set_ylabel(r"$u_2 - u_1$  [mm]")


def _draw_storey(panel: "Axes", motion: MeasuredMotion) -> "list[Axes]":
    """Draw u1 on the left axis and the predicted theta on the right one; returns both axes."""
    shown = [MILLI * motion.u1]
    panel.plot(motion.time, shown[0], color=BLACK, linewidth=1.4, label=r"$u_1$, measured, left axis")
    panel.set_ylabel(r"$u_1$  [mm]")
    if motion.predicted is None:
        centre(panel, *shown)
        return [panel]
    shown.append(MILLI * motion.predicted.u1)
    panel.plot(
        motion.time,
        shown[-1],
        color=SKY,
        linewidth=1.1,
        linestyle=(0, (2, 1.5)),
        label=r"$u_1$, predicted, left axis",
    )
    centre(panel, *shown)
    angle = panel.twinx()
    angle.plot(
        motion.time,
        MILLI * motion.predicted.theta,
        color=VERMILLION,
        linewidth=1.1,
        linestyle=(0, (5, 1.2)),
        label=r"$\vartheta$, predicted only, right axis",
    )
    centre(angle, MILLI * motion.predicted.theta)
    angle.set_ylabel(r"$\vartheta$  [mrad]", color=VERMILLION)
    return [panel, angle]
