"""Results of a data file as rows of measured value, prediction, difference and verdict. Independent of Qt."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan
from typing import Any, cast

from bench.app.display import texts
from bench.app.display.typography import in_screen_unit, spaced, typeset
from bench.app.formatting import ABSENT, measurement
from bench.datafile.tables import Column
from bench.document.typography import first_words, label, without_unit

NO_LABELS: Mapping[str, str] = {}
_UNCERTAINTY, _PREDICTED = "_uncertainty", ("_predicted", "_nominal")
MOST_NAMED = 2
"""Largest number of disagreeing results that are named in the verdict of a run."""
_GOOD = ("", "steady", "held", "measured", "resting")
"""Statuses of a point that are not displayed with its verdict."""


@dataclass(frozen=True)
class Measured:
    """A measured quantity of a point and its prediction, in the SI `unit`, with expanded uncertainties (k = 2). NaN
    where there is no value.

    low, high : bounds of the predicted interval, shown after the predicted value.
    agrees : whether measurement and prediction agree; None without a comparison.
    compared : False if the prediction is only for information: that of an orbit on which the motion is not.
    status : status of the point.
    field : name of the quantity in the data of the point.
    """

    point: str
    quantity: str
    unit: str
    value: float
    uncertainty: float
    predicted: float = nan
    predicted_uncertainty: float = nan
    low: float = nan
    high: float = nan
    agrees: bool | None = None
    status: str = ""
    field: str = ""
    compared: bool = True

    @property
    def off(self) -> float:
        """Measured minus predicted value; NaN if they are not compared."""
        return self.value - self.predicted if self.compared else nan

    @property
    def score(self) -> float:
        """Normalised error E_n: (measured - predicted), divided by the root sum of squares of the expanded
        uncertainties of both. NaN if any of these is missing, or if they are not compared.
        """
        combined = hypot(self.uncertainty, self.predicted_uncertainty)
        return self.off / combined if combined > 0.0 else nan

    @property
    def sentence(self) -> str:
        """The result as a sentence: value, prediction, verdict and point."""
        _, name, value, predicted, off, verdict = self.cells
        words = [f"{name} {value}"]
        if isfinite(self.predicted):
            words.append(f"{texts.PREDICTED} {predicted}")
            if self.agrees is None and self.compared:
                words.append(texts.DIFFERENCE.format(off=off))
        if verdict != ABSENT:
            words.append(verdict)
        return " · ".join([*words, self.point])

    @property
    def cells(self) -> tuple[str, ...]:
        """Cell texts of the row, one for each of `texts.POINT_TITLES`."""
        factor, unit = in_screen_unit(self.unit)
        predicted = measurement(factor * self.predicted, factor * self.predicted_uncertainty, unit)
        if isfinite(self.low) and isfinite(self.high):
            predicted = texts.INTERVAL.format(value=predicted, low=factor * self.low, high=factor * self.high)
        off = self.off
        share = f" ({100.0 * off / self.predicted:+z.1f} %)" if isfinite(off) and self.predicted else ""
        return (
            self.point,
            self.quantity,
            measurement(factor * self.value, factor * self.uncertainty, unit),
            predicted,
            f"{factor * off:+.3g}{'' if unit in ('', '1') else f' {unit}'}{share}" if isfinite(off) else ABSENT,
            self._verdict,
        )

    @property
    def _verdict(self) -> str:
        words = [] if self.status in _GOOD else [self.status]
        if self.agrees is not None:
            words.append(texts.AGREES if self.agrees else texts.DISAGREES)
        return typeset(", ".join(words)) or ABSENT


def rows_of(
    results: Mapping[str, Column], points: Sequence[Mapping[str, Any]], labels: Mapping[str, str] = NO_LABELS
) -> list[Measured]:
    """Rows for all points: one for each field with an uncertainty or, if no field has one, for each number except the
    first, which identifies the point. A loop check has a row for each of its lines. `labels` are the displayed names of
    fields.
    """
    stems = {name: without_unit(name, column.unit) for name, column in results.items()}
    if {"measured", "expected", "unit"} <= results.keys():
        return [_line(point) for point in points]
    named = {stem: name for name, stem in stems.items()}
    found = [name for name, stem in stems.items() if stem + _UNCERTAINTY in named and not stem.endswith(_PREDICTED)]
    if not found:
        numbers = [name for name, column in results.items() if column.unit and not name.endswith("uncertainty")]
        found = [name for name in numbers[1:] if any(isinstance(point[name], float) for point in points)] or numbers
    return [row for point in points for row in _rows(point, found, stems, named, results, labels)]


def summary_of(rows: Sequence[Measured]) -> str:
    """Verdict of a run in one sentence: its only compared result, or the number of results that agree and the first
    ones that do not. Empty without a comparison.
    """
    judged = [row for row in rows if row.agrees is not None]
    if not judged:
        return ""
    if len(judged) == 1:
        return judged[0].sentence
    off = [f"{row.quantity} {texts.AT} {row.point}" for row in judged if not row.agrees]
    agree = texts.AGREEING.format(agree=len(judged) - len(off), judged=len(judged))
    if not off:
        return agree
    more = texts.AND_MORE.format(n=len(off) - MOST_NAMED) if len(off) > MOST_NAMED else ""
    return f"{agree} · {texts.DISAGREES}: {'; '.join(off[:MOST_NAMED])}{more}"


def every_field(
    results: Mapping[str, Column], points: Sequence[Mapping[str, Any]]
) -> tuple[list[str], list[list[str]]]:
    """Column headings with units, and for each point the texts of all its fields."""
    headings: list[str] = []
    for name, column in results.items():
        unit = in_screen_unit(column.unit)[1]
        heading = label(without_unit(name, column.unit))
        headings.append(heading if unit in ("", "1") else f"{heading} [{unit}]")
    return headings, [[_text(point[name], column.unit) for name, column in results.items()] for point in points]


def _rows(
    point: Mapping[str, Any],
    quantities: Sequence[str],
    stems: Mapping[str, str],
    named: Mapping[str, str],
    results: Mapping[str, Column],
    labels: Mapping[str, str],
) -> Iterator[Measured]:
    def value(stem: str) -> float:
        found = point.get(named.get(stem, ""))
        return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else nan

    where, status = _point(point, results), str(point.get("status") or point.get("remarks") or "")
    for name in quantities:
        stem = stems[name]
        own, its = value(stem), value(stem + _UNCERTAINTY)
        beside = next((stem + each for each in _PREDICTED if stem + each in named), "")
        predicted, spread = value(beside), value(beside + _UNCERTAINTY)
        verdict = "agrees" if stem == "alpha_2" and "agrees" in point else f"{stem}_agrees"
        agrees = point.get(verdict)
        # a point without a verdict of its own on a quantity is not compared
        if verdict not in point and isfinite(own - predicted) and isfinite(spread) and its > 0.0:
            agrees = abs(own - predicted) <= hypot(its, spread)
        if isfinite(own) or stem == "alpha_2":
            yield Measured(
                where,
                labels.get(name) or _quantity(stem, results[name].description),
                results[name].unit,
                own,
                its,
                predicted,
                spread,
                value(f"{stem}_low") if isfinite(predicted) else nan,
                value(f"{stem}_high") if isfinite(predicted) else nan,
                None if agrees is None else bool(agrees),
                status,
                name,
                compared=verdict not in point or agrees is not None,
            )


def _line(point: Mapping[str, Any]) -> Measured:
    """Table row for one line of the loop check, in the unit of that line."""

    def number(name: str) -> float:
        value = point.get(name)
        return nan if value is None else float(value)

    return Measured(
        point=label(str(point["subject"])),
        quantity=spaced(str(point["what"])),
        unit=str(point["unit"]),
        value=number("measured"),
        uncertainty=number("uncertainty"),
        predicted=number("expected"),
        status=str(point["verdict"]),
    )


def _point(point: Mapping[str, Any], results: Mapping[str, Column]) -> str:
    beta = point.get("beta")
    if "record" in point and beta is not None:
        return texts.RECORD_POINT.format(record=point["record"], beta=beta)
    if point.get("omega_rad_s") is not None and beta is not None:
        return texts.SINE_POINT.format(omega=point["omega_rad_s"], beta=beta)
    name, column = next(iter(results.items()), ("", None))
    value = point.get(name)
    if column is None or value is None:
        return ABSENT
    if isinstance(value, str):
        return typeset(label(value))
    factor, unit = in_screen_unit(column.unit)
    shown = f"{factor * float(value):.4g}"
    return f"{label(without_unit(name, column.unit))} {shown}{'' if unit in ('', '1') else f' {unit}'}"


def _quantity(stem: str, description: str) -> str:
    """Displayed name of a field: the symbol of a gain, such as α₂, or the first words of the field's description."""
    return label(stem) if stem.startswith("alpha_") and stem[6:].isdigit() else spaced(first_words(description) or stem)


def _text(value: object, unit: str) -> str:
    if value is None or value != value:
        return ABSENT
    if isinstance(value, bool):
        return texts.YES if value else texts.NO
    if isinstance(value, float):
        return f"{in_screen_unit(unit)[0] * value:.5g}"
    text = str(value)
    if text.startswith("{"):
        try:
            parts = cast(dict[str, object], json.loads(text))
        except ValueError:
            return text
        return "; ".join(f"{label(name)} {_text(each, '')}" for name, each in parts.items())
    return spaced(text)
