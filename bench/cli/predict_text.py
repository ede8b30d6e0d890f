"""Predictions as text for a terminal: aligned columns, five significant digits."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bench.cli.words import ABSENT

if TYPE_CHECKING:
    from bench.record.tables import Table

MOST_SPECTRA = 12
"""Stiffnesses up to which each has lines of its own."""


def text_table(table: "Table", columns: Mapping[str, str]) -> str:
    """The chosen `columns` of a table under the headings given for them, with a line of units."""
    return aligned(
        [
            [heading, _unit(table[name].unit), *map(_cell, table[name].values.tolist())]
            for name, heading in columns.items()
        ]
    )


def extremes(table: "Table") -> str:
    """Where alpha_2 is least and greatest, for each layer at each stiffness; of a map, for each layer over all."""
    import numpy as np

    omega, beta, layer, alpha, stable = (
        table[name].values for name in ("omega_rad_s", "beta", "layer", "alpha_2", "stable")
    )
    stiffnesses = np.unique(beta)
    each = [(value, beta == value) for value in stiffnesses]
    groups = each if len(each) <= MOST_SPECTRA else [(None, np.full(beta.size, True))]
    rows: list[list[str]] = [
        ["beta", "layer", "points", "unstable", "least alpha_2", "at omega", "beta", "greatest", "at omega", "beta"],
        ["", "", "", "", "", "[rad/s]", "", "", "[rad/s]", ""],
    ]
    for value, chosen in groups:
        for name in ("rocking", "resting"):
            here = np.flatnonzero(chosen & (layer == name))
            if not here.size:
                continue
            least, most = here[alpha[here].argmin()], here[alpha[here].argmax()]
            known: list[Any] = [ABSENT if value is None else float(value), name, here.size, int((~stable[here]).sum())]
            found = [float(x) for k in (least, most) for x in (alpha[k], omega[k], beta[k])]
            rows.append([_cell(each) for each in (*known, *found)])
    return aligned(list(zip(*rows, strict=True)))


def aligned(columns: Sequence[Sequence[str]]) -> str:
    """Columns of equal length, each beginning with heading and unit, set flush right."""
    set_out: list[list[str]] = []
    for column in columns:
        width = max(map(len, column))
        set_out.append([cell.rjust(width) for cell in column])
    lines = ["  ".join(row).rstrip() for row in zip(*set_out, strict=True)]
    lines.insert(2, "-" * max(map(len, lines)))
    return "\n".join(lines)


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return ABSENT if value != value else f"{value:.5g}"
    return str(value)


def _unit(unit: str) -> str:
    return f"[{unit}]" if unit not in ("", "1") else ""
