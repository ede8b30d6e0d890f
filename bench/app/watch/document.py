"""State of the live page as JSON values: numbers in displayed units, and complete texts."""

from collections.abc import Iterable
from math import ceil, isfinite
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.app.display import texts
from bench.app.display.campaign import Campaign
from bench.app.display.figure import figure_of
from bench.app.display.meters import SOON, Meter
from bench.app.display.picture import FACTOR, Outline, pose_of, source
from bench.app.display.traces import WINDOW, columns_of, labels_of
from bench.app.display.typography import typeset
from bench.app.formatting import clock
from bench.app.ipc.messages import extremes
from bench.app.watch.follower import RunRecord, SessionFollower

BUCKETS = 250
"""Number of intervals of the displayed traces; each is drawn with its minimum and maximum."""
FULL = 500
"""Ordinate of the largest magnitude of a trace; ordinates are sent as integers."""
CURVE = 300
"""Maximum number of intervals to which a long curve is reduced, each with its minimum and maximum."""
LEAST = 1e-3
"""Smallest full-scale value of a trace, in displayed units."""


def document_of(follower: SessionFollower) -> dict[str, object]:
    """The parts of the page's state, by name."""
    record = follower.record
    return {
        "head": _head(follower),
        "verdict": _verdict(record),
        "meters": [_meter(meter, live=not record.stale) for meter in record.meters],
        "picture": _picture(record),
        "matrix": _matrix(record),
        "figure": _figure(record),
        "points": _points(record),
        "traces": _traces(record),
        "log": [[clock(each.time), each.kind, typeset(each.text), each.grave] for each in record.log],
    }


def _head(follower: SessionFollower) -> dict[str, object]:
    status, record, state = follower.status, follower.record, follower.record.state
    running, session = follower.attached, state.attached
    inputs, level = state.inputs_line(running=running)
    question = state.question.request if state.question is not None else ""
    age = record.age if running else state.since_end
    return {
        "word": status.word,
        "reason": typeset(status.reason),
        "level": status.level,
        "shape": status.shape,
        "run": [] if session is None else [session.protocol, session.operator, Path(session.out).name],
        "step": typeset(state.scene.step),
        "inputs": [inputs, level],
        "question": typeset(question),
        "elapsed": clock(state.elapsed) if session is not None else "",
        "remaining": clock(state.scene.time_left) if running and not record.over else "",
        "fraction": round(state.scene.fraction, 3) if running and not record.over else 0.0,
        "live": not record.stale and status.word != texts.NO_LINK,
        "age": texts.NOT_LIVE.format(age=age) if record.stale and isfinite(age) and session else "",
        "others": follower.others,
    }


def _verdict(record: RunRecord) -> dict[str, object]:
    contents, trouble = record.contents, record.trouble
    return {
        "sentence": contents.sentence if contents.protocol is not None else "",
        "point": contents.point,
        "twin": typeset(record.state.scene.twin),
        "trouble": [] if trouble is None else [typeset(trouble.what), typeset(trouble.did)],
    }


def _meter(meter: Meter, *, live: bool) -> dict[str, object]:
    soon = meter.time_to_limit if live else SOON + 1.0
    return {
        "name": meter.name,
        "text": texts.TIME_TO_LIMIT.format(seconds=soon) if soon <= SOON else meter.text,
        "soon": soon <= SOON,
        "share": _share(meter.value / meter.limit),
        "peak": _share(meter.peak / meter.limit) if isfinite(meter.value) else None,
        "planned": _share(meter.planned),
        "level": meter.level,
        "tip": meter.explanation,
    }


def _share(value: float) -> float | None:
    return round(min(value, 1.0), 3) if isfinite(value) else None


def _picture(record: RunRecord) -> dict[str, object] | None:
    run = record.state.run
    if run is None:
        return None
    specimen, arrangement = run.configuration.known_specimen, record.contents.arrangement
    outline, moment = Outline(specimen), record.moment
    signals, angle = record.contents.instant(record.ring, record.block, moment)
    pose = pose_of(signals, angle, arrangement, specimen, FACTOR)
    return {
        "box": _rounded([*outline.ends, outline.height], 4),
        "shapes": [
            [shape.role, *_rounded((x for point in shape.points for x in point), 4)]
            for shape in outline.shapes(pose, arrangement)
        ],
        "source": source(arrangement, pose),
        "factor": FACTOR,
    }


def _matrix(record: RunRecord) -> dict[str, object] | None:
    campaign, protocol = record.campaign, record.contents.protocol
    axes = None if protocol is None else protocol.view.matrix
    if campaign is None or axes is None:
        return None
    return {
        "rows": [axes[0].text(value) for value in campaign.rows],
        "columns": [axes[1].text(value) for value in campaign.columns],
        "cells": [
            [_cell(record, campaign, (row, column)) for column in range(len(campaign.columns))]
            for row in range(len(campaign.rows))
        ],
    }


def _cell(record: RunRecord, campaign: Campaign, place: tuple[int, int]) -> list[str]:
    """Mark, level, text and status of the point at `place` (row, column)."""
    cell, end = campaign.cells[place], record.expected(place)
    mark, level = texts.POINT_MARKS.get(cell.status, texts.POINT_MARKS[texts.POINT_DONE])
    return [mark, level, cell.result or ("" if end is None else texts.EXPECTED.format(time=end)), cell.status]


def _figure(record: RunRecord) -> dict[str, object] | None:
    """Figure of the page: the live view's first panel with measured lines, or else the predicted gain curves."""
    contents = record.contents
    if (panel := record.panel) is not None:
        found = figure_of(panel)
        curves = [
            {"name": curve.name, "fitted": curve.style == "predicted", "points": _thinned(curve.x, curve.y)}
            for curve in found.curves
        ]
        return {"kind": "fit", "title": found.title, "x": found.x_label, "y": found.y_label, "curves": curves}
    if (record.kind is None and not record.marks) or not contents.has_gain:
        return None
    groups = list(dict.fromkeys(line.group for line in record.lines))
    return {
        "kind": "spectrum" if record.kind != "curve" else "curve",
        "title": "",
        "x": texts.BETA_AXIS if record.kind == "curve" else texts.OMEGA_AXIS,
        "y": texts.GAIN_AXIS,
        "curves": [
            {
                "name": line.name,
                "group": groups.index(line.group),
                "weak": not line.strong,
                "points": [_significant(line.x), _significant(line.gain)],
                "band": None if line.band is None else [_significant(line.band[0]), _significant(line.band[1])],
            }
            for line in record.lines
        ],
        "groups": [str(group) for group in groups],
    }


def _points(record: RunRecord) -> dict[str, object]:
    """Measured gains, and the running gain of the point in progress."""
    marks = [
        [_number(mark.x), _number(mark.gain), _number(mark.spread), str(mark.group), mark.varies]
        for mark in record.marks
    ]
    return {"marks": marks, "running": None if record.running is None else [_number(x) for x in record.running]}


def _traces(record: RunRecord) -> dict[str, object]:
    seconds, values = record.ring.window(WINDOW, BUCKETS)
    traces: list[object] = []
    for column, (name, unit, factor) in zip(
        columns_of(record.further), labels_of(record.further, record.contents.arrangement.face), strict=True
    ):
        line = values[:, column].astype(np.float64) * factor
        known = np.isfinite(line)
        reach = max(float(np.abs(line[known]).max(initial=0.0)), LEAST)
        ordinates = [
            value if there else None
            for value, there in zip(
                np.rint(np.where(known, line, 0.0) * (FULL / reach)).astype(int).tolist(), known.tolist(), strict=True
            )
        ]
        traces.append([f"{name} [{unit}]", f"± {reach:.3g}" if known.any() else "", ordinates])
    return {"seconds": _rounded(seconds[::2], 3), "window": WINDOW, "full": FULL, "traces": traces}


def _thinned(x: NDArray[np.float64], y: NDArray[np.float64]) -> list[object]:
    """Abscissas and ordinates of a curve; a long curve is reduced to the extremes of at most `CURVE` intervals."""
    if len(x) > 2 * CURVE:
        width = ceil(len(x) / CURVE)
        low, high = extremes(y[:, None], width)
        x = np.repeat(x[::width], 2)
        y = np.column_stack((low[:, 0], high[:, 0])).ravel().astype(np.float64)
    return [_significant(x), _significant(y)]


def _significant(values: ArrayLike) -> list[float | None]:
    return [_number(value) for value in np.asarray(values, dtype=np.float64).tolist()]


def _number(value: float | None) -> float | None:
    """`value` rounded to five significant digits; None if JSON cannot represent it."""
    return float(f"{value:.5g}") if value is not None and isfinite(value) else None


def _rounded(values: Iterable[float], places: int) -> list[float]:
    return [round(float(value), places) for value in values]
