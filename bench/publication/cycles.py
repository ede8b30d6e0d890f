"""Where in a file a point was measured, and its cycles from the raw channels."""

from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from math import tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT, SIGNALS, U1, SignalMap
from bench.events import Estimate
from bench.publication.campaign import Campaign
from bench.record.reader import Record
from bench.report.measured_figure import MeasuredMotion, Predicted
from sim.gain import Layer

Floats = NDArray[np.float64]

PERIODS, SAMPLES = 3, 120
"""Periods of the drive that are shown, and points of a curve in each: more would only weigh."""

QUIET = 1.5
"""Time at the beginning of a run from which the zero of the signals is taken [s]: the table rests for 2 s."""

BOUNDARIES = ("StepStarted", "StateChanged")
"""Events at which a dwell is over."""


@dataclass(frozen=True, eq=False)
class Cycles:
    """Some periods of one test in the phase of the table: drift and u1 [m], each shape (n,), NaN where none came."""

    drift: Floats
    u1: Floats


class Dwells:
    """Finds the measured cycles of a campaign of sines in its file."""

    def __init__(self, campaign: Campaign, signals: SignalMap) -> None:
        self._record, self._signals = campaign.record, signals
        self._blocks = self._record.blocks
        self._ends = _ends_of_dwells(self._record)

    def motion(self, point: Mapping[str, Any], layer: Layer | None) -> MeasuredMotion | None:
        """The point's last measured cycles; None where the file does not have them. `layer`: as the model has it."""
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
            predicted=None if layer is None else _predicted(layer),
        )

    def _cycles(self, omega: float, beta: float | None, peak: float | None) -> Cycles | None:
        """Of several tries, the one whose peak is the nearest to the point's."""
        tries = [self._last_cycles(end, omega) for end in self._ends.get((omega, beta), ())]
        whole = [each for each in tries if each is not None]
        if peak is None or not whole:
            return None
        return min(whole, key=lambda each: abs(float(np.nanmax(np.abs(each.drift))) - peak))

    def _last_cycles(self, end: float, omega: float) -> Cycles | None:
        """The last whole periods before `end` [s of the bench] that begin with the table's sine; None without them."""
        block = bisect_right(self._blocks["time"], end + 1e-6) - 1
        if block < 0:
            return None
        rows, runs = self._blocks["row"], self._blocks["run"]
        stop = int(rows[block + 1]) if block + 1 < rows.size else self._record.rows
        start = int(rows[bisect_left(runs, runs[block])])
        period = tau / omega * self._record.sample_rate
        begin = stop - round((PERIODS + 1) * period)
        rest = round(QUIET * self._record.sample_rate)
        if begin <= start + rest:
            return None
        self._signals.tare(self._values(start, start + rest))
        return _in_phase(self._signals.of(self._values(begin, stop)), period)

    def _values(self, start: int, stop: int) -> Floats:
        channels = self._record.channels
        return np.column_stack([self._record.values(channel.name, slice(start, stop)) for channel in channels])


def _ends_of_dwells(record: Record) -> dict[tuple[float, float | None], list[float]]:
    """When the dwells of each frequency and stiffness (None: the bare frame) were over [s of the bench].

    The running estimates tell which test was going on; the dwell whose cycles count follows the last of them.
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
    """Means over short equal parts of the period, from the first upward zero of the table's fundamental on."""
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


def _predicted(layer: Layer) -> Predicted:
    u1, u2, theta = np.tile(layer.orbit.samples(SAMPLES)[:, 1:], (PERIODS, 1)).T
    return Predicted(drift=u2 - u1, u1=u1, theta=theta)
