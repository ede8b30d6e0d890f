"""What a prediction and the points of a run come to on the axes of a gain plot. Knows nothing of Qt.

Under sines the gain stands over the frequency, with a line per stiffness and layer; under records over the stiffness,
with a line per record.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bench.gui import texts
from bench.record.tables import Table

Kind = Literal["spectrum", "curve"]

LOW, HIGH = "alpha_2_low", "alpha_2_high"
"""Columns of a prediction: the band round alpha_2 (k = 2), where it is known."""
LEAST = 1e-3
"""Smallest gain that is drawn: the axis of a spectrum is logarithmic."""
_SPECTRUM = frozenset({"omega", "beta", "alpha_2", "layer"})
_CURVE = frozenset({"record", "beta", "alpha_2"})


@dataclass(frozen=True, eq=False)
class Line:
    """A predicted line, ascending in `x`; `band`, shape (2, n), is its lower and upper bound. All in SI units.

    `group` is what its colour stands for: a stiffness, or a record; a line that is not `strong` is the weaker layer.
    """

    group: float | str
    name: str
    x: NDArray[np.float64]
    gain: NDArray[np.float64]
    band: NDArray[np.float64] | None
    strong: bool = True


@dataclass(frozen=True)
class Mark:
    """A measured point; `gain` is None where none was measured, `spread` its expanded uncertainty."""

    group: float | str
    x: float
    gain: float | None
    spread: float
    status: str

    @property
    def key(self) -> tuple[float | str, float]:
        """What the same point of another run has in common with it."""
        return self.group, round(self.x, 6)


def kind_of(prediction: Table) -> Kind | None:
    """Which axes a prediction belongs on; None for one that cannot be drawn."""
    if prediction.keys() >= _CURVE:
        return "curve"
    return "spectrum" if prediction.keys() >= _SPECTRUM else None


def lines_of(prediction: Table) -> list[Line]:
    """The lines of a prediction; none for one that cannot be drawn."""
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
    layer = columns["layer"].astype(str)
    return [
        _line(
            columns,
            (beta == each) & (layer == kind),
            "omega",
            float(each),
            f"{texts.PREDICTED}, β = {each:g}, {kind}",
            strong=kind == "rocking",
        )
        for each in np.unique(beta)
        for kind in ("rocking", "resting")
        if ((beta == each) & (layer == kind)).any()
    ]


def mark_of(point: Mapping[str, Any]) -> Mark | None:
    """A point as it was recorded; None for one that is no point of gain."""
    beta = point.get("beta")
    if beta is None or "alpha_2" not in point:
        return None
    gain = point["alpha_2"]
    gain = float(gain) if gain is not None and gain > 0.0 else None
    spread, status = float(point.get("alpha_2_uncertainty") or 0.0), str(point.get("status", ""))
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
