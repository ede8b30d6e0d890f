"""The points of a campaign as text for the terminal."""

import textwrap
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from bench.report.rows import PointLike, plain

WIDTH = 118
ABSENT = "-"


@dataclass(frozen=True)
class _Column:
    title: str
    unit: str
    show: Callable[[dict[str, Any]], str]
    left: bool = False


def points_table(points: Sequence[PointLike]) -> str:
    """A table of harmonic points, at most 118 columns wide, and below it the points that need a look.

    "-" stands where a value is absent; a disagreement with the prediction is marked "NO <" in the last column.
    """
    rows = plain(points)
    cells = [[column.title for column in _COLUMNS], [f"[{column.unit}]" if column.unit else "" for column in _COLUMNS]]
    cells += [[column.show(row) for column in _COLUMNS] for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(len(_COLUMNS))]
    lines = [
        "  ".join(
            text.ljust(width) if column.left else text.rjust(width)
            for text, width, column in zip(line, widths, _COLUMNS, strict=True)
        ).rstrip()
        for line in cells
    ]
    lines.insert(2, "-" * (sum(widths) + 2 * (len(widths) - 1)))
    return "\n".join([*lines, *_remarks(rows)])


def _remarks(rows: list[dict[str, Any]]) -> list[str]:
    disagreeing = sum(row.get("agrees") is False for row in rows)
    compared = sum(row.get("agrees") is not None for row in rows)
    lines = ["", f"{compared} of {len(rows)} points compared with the prediction, {disagreeing} disagree."]
    lines += _uncertainty(rows)
    for row in rows:
        if row.get("reason"):
            head = f"omega {row['omega_rad_s']:g} rad/s, beta {row['beta']:g}: "
            lines += textwrap.wrap(head + str(row["reason"]), WIDTH, subsequent_indent="    ")
    return lines


def _uncertainty(rows: list[dict[str, Any]]) -> list[str]:
    """How uncertain the gains are, and what counts most in it; nothing where no budget is kept."""
    known = [row for row in rows if row.get("dominating") and row.get("alpha_2")]
    if not known:
        return []
    sizes = [100.0 * row["alpha_2_uncertainty"] / row["alpha_2"] for row in known]
    most = Counter(str(row["dominating"]) for row in known).most_common()
    named = ", ".join(f"{name} ({number})" for name, number in most)
    return textwrap.wrap(
        f"alpha_2 is uncertain by {min(sizes):.2f} to {max(sizes):.2f} % (k = 2); the largest parts: {named}.", WIDTH
    )


def _number(name: str, form: str) -> Callable[[dict[str, Any]], str]:
    def show(row: dict[str, Any]) -> str:
        value = row.get(name)
        return ABSENT if value is None else format(value, form)

    return show


def _word(name: str) -> Callable[[dict[str, Any]], str]:
    return lambda row: str(row.get(name) or ABSENT)


def _difference(row: dict[str, Any]) -> str:
    measured, predicted = row.get("alpha_2"), row.get("alpha_2_predicted")
    return f"{100.0 * (measured / predicted - 1.0):+.2f}" if measured is not None and predicted else ABSENT


def _verdict(name: str, yes: str, no: str) -> Callable[[dict[str, Any]], str]:
    def show(row: dict[str, Any]) -> str:
        value = row.get(name)
        return ABSENT if value is None else yes if value else no

    return show


_COLUMNS = (
    _Column("beta", "1", _number("beta", ".3f")),
    _Column("omega", "rad/s", _number("omega_rad_s", ".3f")),
    _Column("status", "", _word("status"), left=True),
    _Column("layer", "", _word("layer"), left=True),
    _Column("alpha_2", "1", _number("alpha_2", ".4f")),
    _Column("U (k=2)", "1", _number("alpha_2_uncertainty", ".4f")),
    _Column("predicted", "1", _number("alpha_2_predicted", ".4f")),
    _Column("diff.", "%", _difference),
    _Column("orbit", "", _verdict("predicted_stable", "stable", "unstable"), left=True),
    _Column("starts", "1", _number("starts_tried", "d")),
    _Column("chance", "1", _number("start_chance", ".2f")),
    _Column("settled", "s", _number("settle_time_s", ".1f")),
    _Column("agrees", "", _verdict("agrees", "yes", "NO <"), left=True),
)
