"""A preflight as tables: for the file, in which it lies before the first sample moves, and for people."""

from collections.abc import Sequence
from math import nan

import numpy as np

from bench.preflight.forecast import Stage
from bench.preflight.margins import Margin
from bench.record.tables import Column, Table


def margins_table(margins: Sequence[Margin]) -> Table:
    """One row for each limited quantity, tightest first."""

    def numbers(values: list[float | None], unit: str, description: str) -> Column:
        return Column(np.array([nan if value is None else value for value in values]), unit, description)

    def texts(values: list[str], description: str) -> Column:
        return Column(np.array(values, dtype=np.str_), "", description)

    assumed, likely = "for the specimen as assumed", "that 95 % of the specimens within the uncertainty stay below"
    return {
        "quantity": texts([each.bound.name for each in margins], "what is limited"),
        "margin": numbers([each.margin for each in margins], "1", f"1 - demand / limit, {assumed}; NaN: not predicted"),
        "margin_95": numbers([each.likely for each in margins], "1", f"1 - demand / limit, for the demand {likely}"),
        "demand": numbers([each.demand.value for each in margins], "SI", f"largest predicted value {assumed}"),
        "demand_95": numbers([each.demand.likely for each in margins], "SI", f"largest predicted value {likely}"),
        "limit": numbers([each.bound.limit for each in margins], "SI", "largest allowed value"),
        "unit": texts([each.bound.unit for each in margins], "unit of demands and limit in this row"),
        "owner": texts([each.bound.owner for each in margins], "what sets the limit"),
        "where": texts([each.demand.where for each in margins], "when the demand occurs, or why it is not predicted"),
    }


def drive_table(stages: Sequence[Stage]) -> Table:
    """One row for each leg of the planned drive; a stage begins from silence."""
    rows = [(stage, leg) for stage in stages for leg in stage.legs]
    chances = [nan if stage.chance is None else stage.chance for stage, _ in rows]
    return {
        "stage": Column(np.array([stage.name for stage, _ in rows], dtype=np.str_), "", "part of the run"),
        "chance": Column(np.array(chances), "1", "estimated chance that the start succeeds; NaN: it is no start"),
        "duration": Column(np.array([leg.duration for _, leg in rows]), "s", "length of the leg"),
        "amplitude": Column(np.array([leg.amplitude for _, leg in rows]), "m/s2", "table acceleration at its end"),
        "omega": Column(np.array([leg.omega for _, leg in rows]), "rad/s", "circular frequency at its end"),
    }
