"""Report parts shared by decays of the frame and of the springs."""

from collections.abc import Mapping, Sequence
from typing import Any

from bench.document.typography import ABSENT, with_uncertainty

Rows = Sequence[Mapping[str, Any]]

EXPANDED = "Uncertainties are expanded (k = 2) and include the uncertainty of the masses."


def decay_label(row: Mapping[str, Any]) -> str:
    """Number of a decay; "all" for their combination."""
    return str(row["decay"]) if row["decay"] else "all"


def expanded_text(row: Mapping[str, Any], name: str, uncertain: str, factor: float = 1.0) -> str:
    """A field of a point with its expanded uncertainty, both multiplied by `factor`."""
    value, uncertainty = row[name], row[f"{uncertain}_uncertainty"]
    return ABSENT if value is None else with_uncertainty(factor * value, factor * (uncertainty or 0.0))
