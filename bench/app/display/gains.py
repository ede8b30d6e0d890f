"""Predicted lines and measured points on the axes of a gain plot, and the comparison of two runs. Independent of Qt.
The abscissa is the frequency for sines, with a line per stiffness and branch, and the stiffness for records, with a
line per record.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, nan
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.app.display import texts
from bench.datafile.tables import Table

Kind = Literal["spectrum", "curve"]

LOW, HIGH = "alpha_2_low", "alpha_2_high"
"""Columns of a prediction with the bounds of the gain alpha_2 (k = 2); a prediction may lack them."""
LEAST = 1e-3
"""Lower bound of drawn gains, because the axis of a spectrum is logarithmic; smaller ones are drawn at this value."""
NOT_PLAYED = "not played"
"""Status of points whose motion was not played; they are not drawn."""
_SPECTRUM = frozenset({"omega", "beta", "alpha_2", "layer"})
_CURVE = frozenset({"record", "beta", "alpha_2"})


@dataclass(frozen=True, eq=False)
class Line:
    """A predicted line, in SI units.

    group : stiffness or name of the record, represented by the colour.
    x, gain : abscissa, ascending, and gain, both of shape (n,).
    band : lower and upper bounds of the gain, shape (2, n), NaN where the motion is unstable; None if unknown.
    strong : whether the line is drawn thick; False for the branch of the resting block.
    """

    group: float | str
    name: str
    x: NDArray[np.float64]
    gain: NDArray[np.float64]
    band: NDArray[np.float64] | None
    strong: bool = True


@dataclass(frozen=True)
class Mark:
    """A measured point at abscissa `x`; `gain` is None if none was measured, and `spread` is the expanded uncertainty
    of the gain.
    """

    group: float | str
    x: float
    gain: float | None
    spread: float
    status: str

    @property
    def kind(self) -> Kind:
        """Kind of axes on which the point is drawn."""
        return "curve" if isinstance(self.group, str) else "spectrum"

    @property
    def varies(self) -> bool:
        """Whether the motion was modulated: the gain is that of its largest drift, which no other test must repeat."""
        return self.status == "modulated"

    @property
    def key(self) -> tuple[float | str, float]:
        """Key that identifies the same point in another run."""
        return self.group, round(self.x, 6)


def kind_of(prediction: Table) -> Kind | None:
    """Kind of axes for a prediction; None for one without gains."""
    if prediction.keys() >= _CURVE:
        return "curve"
    return "spectrum" if prediction.keys() >= _SPECTRUM else None


def lines_of(prediction: Table) -> list[Line]:
    """The lines of a prediction; empty if it cannot be drawn."""
    kind = kind_of(prediction)
    if kind is None:
        return []
    columns = {name: column.values for name, column in prediction.items()}
    beta = np.round(columns["beta"].astype(np.float64), 6)
    if kind == "curve":
        records = columns["record"].astype(str)
        return [
            _line(columns, records == name, "beta", name, f"{texts.PREDICTED}, {name}")
            for name in dict.fromkeys(records)
        ]
    branch = columns["layer"].astype(str)
    return [
        _line(
            columns,
            (beta == each) & (branch == kind),
            "omega",
            float(each),
            f"{texts.PREDICTED}, β = {each:g}, {kind}",
            strong=kind == "rocking",
        )
        for each in np.unique(beta)
        for kind in ("rocking", "resting")
        if ((beta == each) & (branch == kind)).any()
    ]


def mark_of(point: Mapping[str, Any]) -> Mark | None:
    """The mark for a recorded point; None if the point has no gain fields, or if its motion was not played."""
    beta = point.get("beta")
    if beta is None or "alpha_2" not in point:
        return None
    gain = point["alpha_2"]
    gain = float(gain) if gain is not None and gain > 0.0 else None
    spread, status = float(point.get("alpha_2_uncertainty") or 0.0), str(point.get("status", ""))
    if status == NOT_PLAYED:
        return None
    if "record" in point:
        return Mark(str(point["record"]), float(beta), gain, spread, status)
    if point.get("omega_rad_s") is None:
        return None
    return Mark(round(float(beta), 6), float(point["omega_rad_s"]), gain, spread, status)


def _line(
    columns: Mapping[str, NDArray[Any]],
    chosen: NDArray[np.bool_],
    x: str,
    group: float | str,
    name: str,
    *,
    strong: bool = True,
) -> Line:
    rows = np.flatnonzero(chosen)
    rows = rows[np.argsort(columns[x][rows], kind="stable")]
    band = None
    if columns.keys() >= {LOW, HIGH}:
        band = np.array([columns[LOW][rows], columns[HIGH][rows]], dtype=np.float64)
        if "stable" in columns:
            band[:, ~columns["stable"][rows].astype(np.bool_)] = np.nan
        band = np.maximum(band, LEAST) if np.isfinite(band).any() else None
    gain = np.maximum(columns["alpha_2"][rows].astype(np.float64), LEAST)
    return Line(group, name, columns[x][rows].astype(np.float64), gain, band, strong)


@dataclass(frozen=True)
class Difference:
    """A point in the reference and in another run; a gain that was not measured is None. `uncertainty` is the expanded
    uncertainty (k = 2) of the difference, with the two gains assumed independent; NaN unless both were measured, and
    for modulated motions, whose uncertainty does not say how much the largest drift varies from test to test.
    """

    point: str
    reference: float | None
    other: float | None
    uncertainty: float

    @property
    def value(self) -> float:
        """The other gain minus that of the reference; NaN if either is missing."""
        return nan if self.reference is None or self.other is None else self.other - self.reference

    @property
    def score(self) -> float:
        """|difference| divided by its uncertainty, the E_n score of ISO 13528: above 1, the runs differ significantly.
        NaN if unknown.
        """
        return abs(self.value) / self.uncertainty if self.uncertainty > 0.0 else nan


def compare(reference: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> list[Difference]:
    """Compare every point of either run, those of the reference first. Of repeated measurements, the last one is used.
    Uncertainties are the root sum of squares of the points' uncertainties (k = 2).
    """
    before, after = _by_key(reference), _by_key(other)
    return [_difference(before.get(key), after.get(key)) for key in {**before, **after}]


def _by_key(points: Sequence[Mapping[str, Any]]) -> dict[tuple[float | str, float], Mark]:
    return {mark.key: mark for mark in map(mark_of, points) if mark is not None}


def _difference(first: Mark | None, second: Mark | None) -> Difference:
    known = first or second
    assert known is not None
    gains = [None if mark is None else mark.gain for mark in (first, second)]
    spread = nan
    if first is not None and second is not None and None not in gains and not (first.varies or second.varies):
        spread = hypot(first.spread, second.spread)
    if isinstance(known.group, str):
        point = texts.RECORD_POINT.format(record=known.group, beta=known.x)
    else:
        point = texts.SINE_POINT.format(omega=known.x, beta=known.group)
    return Difference(point, gains[0], gains[1], spread)
