"""The points of a campaign as text for the terminal."""

import textwrap
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from bench.report.rows import PointLike, plain
from bench.report.text_table import TextColumn, text_table

WIDTH = 118
ABSENT = "-"


_Row = dict[str, Any]


def points_table(points: Sequence[PointLike]) -> str:
    """A table of harmonic points, at most 118 columns wide, and below it the points that need a look.

    "-" stands where a value is absent; a disagreement with the prediction is marked "NO <" in the last column.
    """
    rows = plain(points)
    table = text_table([column for column, _ in _COLUMNS], ([cell(row) for _, cell in _COLUMNS] for row in rows))
    return "\n".join([table, *_remarks(rows)])


def _remarks(rows: list[_Row]) -> list[str]:
    disagreeing = sum(row.get("agrees") is False for row in rows)
    compared = sum(row.get("agrees") is not None for row in rows)
    lines = ["", f"{compared} of {len(rows)} points compared with the prediction, {disagreeing} disagree."]
    lines += _uncertainty(rows)
    for row in rows:
        if row.get("reason"):
            head = f"omega {row['omega_rad_s']:g} rad/s, beta {row['beta']:g}: "
            lines += textwrap.wrap(head + str(row["reason"]), WIDTH, subsequent_indent="    ")
    return lines


def _uncertainty(rows: list[_Row]) -> list[str]:
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


def _number(name: str, form: str) -> Callable[[_Row], str]:
    def show(row: _Row) -> str:
        value = row.get(name)
        return ABSENT if value is None else format(value, form)

    return show


def _word(name: str) -> Callable[[_Row], str]:
    return lambda row: str(row.get(name) or ABSENT)


def _difference(row: _Row) -> str:
    measured, predicted = row.get("alpha_2"), row.get("alpha_2_predicted")
    return f"{100.0 * (measured / predicted - 1.0):+.2f}" if measured is not None and predicted else ABSENT


def _verdict(name: str, yes: str, no: str) -> Callable[[_Row], str]:
    def show(row: _Row) -> str:
        value = row.get(name)
        return ABSENT if value is None else yes if value else no

    return show


_COLUMNS: tuple[tuple[TextColumn, Callable[[_Row], str]], ...] = (
    (TextColumn("beta", "1"), _number("beta", ".3f")),
    (TextColumn("omega", "rad/s"), _number("omega_rad_s", ".3f")),
    (TextColumn("status", words=True), _word("status")),
    (TextColumn("layer", words=True), _word("layer")),
    (TextColumn("alpha_2", "1"), _number("alpha_2", ".4f")),
    (TextColumn("U (k=2)", "1"), _number("alpha_2_uncertainty", ".4f")),
    (TextColumn("predicted", "1"), _number("alpha_2_predicted", ".4f")),
    (TextColumn("diff.", "%"), _difference),
    (TextColumn("orbit", words=True), _verdict("predicted_stable", "stable", "unstable")),
    (TextColumn("starts", "1"), _number("starts_tried", "d")),
    (TextColumn("chance", "1"), _number("start_chance", ".2f")),
    (TextColumn("settled", "s"), _number("settle_time_s", ".1f")),
    (TextColumn("agrees", words=True), _verdict("agrees", "yes", "NO <")),
)
