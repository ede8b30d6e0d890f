"""The points of a seismic campaign as text for the terminal."""

import textwrap
from collections.abc import Sequence
from typing import Any

from bench.report.rows import PointLike, plain
from bench.report.text_table import TextColumn, text_table

WIDTH = 120
ABSENT = "-"

_COLUMNS = (
    TextColumn("record", words=True),
    TextColumn("beta"),
    TextColumn("status", words=True),
    TextColumn("alpha_2"),
    TextColumn("U (k=2)"),
    TextColumn("predicted"),
    TextColumn("95 % interval"),
    TextColumn("target"),
    TextColumn("topples"),
    TextColumn("agrees", words=True),
    TextColumn("dominated by", words=True),
)


def earthquake_table(points: Sequence[PointLike]) -> str:
    """A row per point, and below them how many agree and what needs a look. "-" stands where a value is absent."""
    rows = plain(points)
    return "\n".join([text_table(_COLUMNS, map(_cells, rows)), *_remarks(rows)])


def _cells(row: dict[str, Any]) -> list[str]:
    low, high, agrees = row["alpha_2_low"], row["alpha_2_high"], row["agrees"]
    return [
        str(row["record"]),
        f"{row['beta']:g}",
        str(row["status"]),
        _number(row["alpha_2"]),
        _number(row["alpha_2_uncertainty"]),
        _number(row["alpha_2_predicted"]),
        ABSENT if low is None else f"{low:.3f} to {high:.3f}",
        _number(row["alpha_2_target"]),
        ABSENT if row["topple_chance"] is None else f"{row['topple_chance']:.0%}",
        ABSENT if agrees is None else "yes" if agrees else "NO <",
        row["dominating"] or ABSENT,
    ]


def _remarks(rows: Sequence[dict[str, Any]]) -> list[str]:
    compared = [row for row in rows if row["agrees"] is not None]
    agreeing = sum(bool(row["agrees"]) for row in compared)
    toppled = sum(row["status"] == "overturned" for row in rows)
    lines = [
        "",
        f"{agreeing} of {len(compared)} gains agree with the prediction, {toppled} of {len(rows)} runs toppled.",
    ]
    for row in rows:
        if row["reason"]:
            head = f"{row['record']}, beta {row['beta']:g}: "
            lines += textwrap.wrap(head + str(row["reason"]), WIDTH, subsequent_indent="    ")
    return lines


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.4f}"
