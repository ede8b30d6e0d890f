"""Old and new results of a re-analysis, side by side."""

from collections.abc import Mapping, Sequence
from typing import Any

from bench.cli.words import ABSENT
from bench.report.text_table import TextColumn, text_table
from sim.parameters import Parameters, unit_of

HEADLINES = ("status", "alpha_2", "alpha_2_uncertainty", "alpha_2_predicted", "agrees")
"""Fields that are printed where a point has them; the file holds all."""

WIDEST = 44
"""Characters of a value or label that are printed."""


def side_by_side(kind: type[Parameters], stored: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]]) -> str:
    """Old and new values of what is most looked at, one line each; of other points all that changed."""
    fields = kind.model_fields
    labels = list(fields)[:2]
    shown = [name for name in HEADLINES if name in fields]
    rows: list[list[str]] = []
    for before, after in zip(stored, new, strict=True):
        label = ", ".join(_shown(after[name]) for name in labels)
        names = shown or [name for name in fields if before.get(name) != after[name]]
        for name in names:
            was, now = before.get(name), after[name]
            rows.append([label, name, unit_of(fields[name]), _shown(was), _shown(now), _change(was, now)])
    if not rows:
        return "No result changed."
    columns = (
        TextColumn(", ".join(labels), words=True),
        TextColumn("result", words=True),
        TextColumn("unit", words=True),
        TextColumn("recorded"),
        TextColumn("new"),
        TextColumn("change", "%"),
    )
    return text_table(columns, rows)


def _shown(value: Any) -> str:
    if value is None or value != value:
        return ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…"


def _change(was: Any, now: Any) -> str:
    if isinstance(was, float) and isinstance(now, float) and was:
        return f"{100.0 * (now / was - 1.0):+.3f}"
    return "" if was == now else "changed"
