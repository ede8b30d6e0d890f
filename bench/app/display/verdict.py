"""The verdict of a run in one sentence."""

from collections.abc import Mapping
from math import isfinite, nan

import numpy as np

from bench.app.display import texts
from bench.app.display.point_table import rows_of
from bench.app.display.typography import typeset
from bench.app.formatting import difference, measurement, number, plus_minus
from bench.datafile.tables import Column
from bench.document.typography import counted, unit_text
from bench.live_values import Estimate, LiveValue, RunningGain
from bench.protocol import RunView
from sim.parameters import Parameters, unit_of


def verdict_of(view: RunView, finished: Parameters) -> str:
    """The result of a finished point: value, prediction, verdict and point, or the reason for a missing value."""
    point = finished.model_dump()
    rows = rows_of(columns_of(type(finished)), [point], view.labels)
    found = next((row for row in rows if row.field == view.headline), rows[0] if rows else None)
    if found is not None and isfinite(found.value):
        return found.sentence.replace(" = ", " ")
    status, reason = str(point.get("status") or texts.NO_VALUE), str(point.get("reason") or "")
    return " · ".join(part for part in (texts.NO_GAIN_OF.format(status=status), typeset(reason)) if part)


def running_verdict(event: Estimate | RunningGain | LiveValue, nothing: str = texts.NO_GAIN) -> str:
    """A running value with its prediction, its difference from the prediction, and, for a gain, the cycles or seconds
    measured so far; `nothing` is the text for a gain that is unknown.
    """
    if isinstance(event, LiveValue):
        label = typeset(event.label)
        value, effort = f"{label}  {measurement(event.value, event.uncertainty, unit_text(event.unit))}", ""
        own, predicted = event.value, event.predicted
    else:
        own, predicted = event.alpha_2, event.predicted
        uncertainty = event.uncertainty if isinstance(event, Estimate) else nan
        value = f"{texts.ALPHA} {plus_minus(own, uncertainty)}" if isfinite(own) else nothing
        effort = (
            counted(event.cycles, "cycle")
            if isinstance(event, Estimate)
            else texts.SO_FAR.format(seconds=event.seconds, record=event.record)
        )
    words = [value]
    if isfinite(own) and isfinite(predicted):
        words += [f"{texts.PREDICTED} {number(predicted)}", difference(own, predicted)]
    return " · ".join([*words, effort] if effort else words)


def columns_of(point: type[Parameters]) -> Mapping[str, Column]:
    """The declared fields of a point as empty columns, with unit and description."""
    return {
        name: Column(np.zeros(0), unit_of(declared), declared.description or "")
        for name, declared in point.model_fields.items()
    }
