"""Predictions as text for a terminal, with five significant digits."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bench.cli.words import ABSENT
from bench.report.text_table import TextColumn, text_table

if TYPE_CHECKING:
    from bench.record.tables import Table

MOST_SPECTRA = 12
"""Stiffnesses up to which each has lines of its own."""


def prediction_table(table: "Table", headings: Mapping[str, str]) -> str:
    """Columns of a table, by their names, under the headings given for them."""
    columns = [TextColumn(heading, _unit(table[name].unit)) for name, heading in headings.items()]
    cells = (map(_cell, table[name].values.tolist()) for name in headings)
    return text_table(columns, zip(*cells, strict=True))


def extremes(table: "Table") -> str:
    """Where alpha_2 is least and greatest, for each layer at each stiffness; of a map, for each layer over all."""
    import numpy as np

    omega, beta, layer, alpha, stable = (
        table[name].values for name in ("omega_rad_s", "beta", "layer", "alpha_2", "stable")
    )
    stiffnesses = np.unique(beta)
    each = [(value, beta == value) for value in stiffnesses]
    groups = each if len(each) <= MOST_SPECTRA else [(None, np.full(beta.size, True))]
    where = (TextColumn("at omega", "rad/s"), TextColumn("beta"))
    group = (TextColumn("beta"), TextColumn("layer"), TextColumn("points"), TextColumn("unstable"))
    columns = (*group, TextColumn("least alpha_2"), *where, TextColumn("greatest"), *where)
    rows: list[list[str]] = []
    for value, chosen in groups:
        for name in ("rocking", "resting"):
            here = np.flatnonzero(chosen & (layer == name))
            if not here.size:
                continue
            least, most = here[alpha[here].argmin()], here[alpha[here].argmax()]
            known: list[Any] = [ABSENT if value is None else float(value), name, here.size, int((~stable[here]).sum())]
            found = [float(x) for k in (least, most) for x in (alpha[k], omega[k], beta[k])]
            rows.append([_cell(each) for each in (*known, *found)])
    return text_table(columns, rows)


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return ABSENT if value != value else f"{value:.5g}"
    return str(value)


def _unit(unit: str) -> str:
    return unit if unit != "1" else ""
