"""Live view of a run: the plots and lists below the verdict in the window, declared by the protocol as one function.

The function receives a `LiveRun` with the events of the run up to now, and returns the parts of the view, mostly
`Panel` objects. It is called before the first result, when the parts show predictions and announce the results, and
after each result.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.config.model import BenchConfiguration
from bench.datafile.tables import Table
from bench.events import Event, PointFinished, Progress, StateChanged, StepStarted, Warned
from bench.findings import FitFinished, TableIdentified
from bench.live_values import Estimate, LiveValue, RunningGain, TwinEstimate
from sim.parameters import Parameters

Array = NDArray[np.float64]
E = TypeVar("E", bound=Event)

FITS, KEPT = 60, 2000
"""Maximum number of stored events of a type with arrays, such as fits with recordings, and of any other type. All
points are stored.
"""
MOST = 6
"""Maximum number of curves of one fit in a panel."""
DERIVED = ("residual", "uncertainty")
"""Suffixes of the names of series of a fit that are not drawn."""
FITTED = "fitted"
"""Suffix of the names of series of a fit that are computed by its model."""
_ELSEWHERE = (Progress, StateChanged, StepStarted, Warned, Estimate, RunningGain, TwinEstimate)
"""Events that other parts of the window show."""

Style: TypeAlias = Literal["line", "points", "predicted", "reference"]


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve in the units of its panel; `x`, `y` and `spread`, the expanded uncertainties of `y` if known, have shape
    (n,).
    """

    name: str
    x: Array
    y: Array
    style: Style
    spread: Array | None = None

    @property
    def measured(self) -> bool:
        """Whether the curve is a result of the run."""
        return self.style in ("line", "points")


@dataclass(eq=False)
class Panel:
    """Axes with curves. `x` and `y` are the name and the unit of each axis, "1" for a pure number.

    The methods that add curves omit a curve without a finite point; arrays of different shapes raise ValueError.

    awaits : sentence that announces the result, shown until there is one.
    logarithmic : the axes that have a logarithmic scale.
    equal : whether both axes have the same scale, as for a complex plane.
    """

    title: str
    x: tuple[str, str] = ("", "1")
    y: tuple[str, str] = ("", "1")
    awaits: str = "The results of the run appear here."
    logarithmic: Literal["", "x", "y", "xy"] = ""
    equal: bool = False
    curves: list[Curve] = field(default_factory=list[Curve])

    @property
    def empty(self) -> bool:
        """Whether there is no result yet."""
        return not any(curve.measured for curve in self.curves)

    def line(self, name: str, x: ArrayLike, y: ArrayLike) -> "Panel":
        """Add a measured line; returns the panel."""
        return self._add(name, x, y, "line")

    def points(self, name: str, x: ArrayLike, y: ArrayLike, spread: ArrayLike | None = None) -> "Panel":
        """Add measured points with their expanded uncertainties, NaN if unknown; returns the panel."""
        return self._add(name, x, y, "points", spread)

    def predicted(self, name: str, x: ArrayLike, y: ArrayLike) -> "Panel":
        """Add a predicted or fitted line; returns the panel."""
        return self._add(name, x, y, "predicted")

    def reference(self, x: ArrayLike, y: ArrayLike) -> "Panel":
        """Add a thin line without a name, such as the unit circle; returns the panel."""
        return self._add("", x, y, "reference")

    def fit(self, fit: FitFinished) -> "Panel":
        """Add the series of a fit that have the unit of `y`, at most `MOST`, against its first series; returns the
        panel.
        """
        (_, along), *others = fit.columns.items()
        chosen = [
            (name, series.values)
            for name, series in others
            if series.unit == self.y[1] and not name.endswith(DERIVED) and np.isfinite(series.values).any()
        ]
        for name, values in chosen[:MOST]:
            self._add(name, along.values, values, "predicted" if name.endswith(FITTED) else "line")
        return self

    def _add(self, name: str, x: ArrayLike, y: ArrayLike, style: Style, spread: ArrayLike | None = None) -> "Panel":
        place, value = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        expanded = None if spread is None else np.asarray(spread, dtype=np.float64)
        shapes = {each.shape for each in (place, value, expanded) if each is not None}
        if len(shapes) != 1 or place.ndim != 1:
            raise ValueError(
                f"the arrays of the curve {name!r} have shapes {shapes}; all must have the same shape (n,)"
            )
        if (np.isfinite(place) & np.isfinite(value)).any():
            self.curves.append(Curve(name, place, value, style, expanded))
        return self


@dataclass(frozen=True)
class GainCurve:
    """Measured gains alpha_2 and their predicted lines against frequency or, for records, against stiffness ratio."""


Verdict: TypeAlias = Literal["passed", "failed", "pending", "other"]


@dataclass(frozen=True)
class Check:
    """A line of a checklist: the checked item, its verdict, and the measured value or the remedy as text."""

    what: str
    verdict: Verdict
    text: str = ""


@dataclass(frozen=True)
class Checklist:
    """Checks in the order of the run, including those that are still pending."""

    checks: tuple[Check, ...]


LiveView: TypeAlias = Sequence[Panel | GainCurve | Checklist]


def _is_large(event: Event) -> bool:
    values = (getattr(event, each.name) for each in fields(event))
    return isinstance(event, FitFinished) or any(isinstance(value, np.ndarray) for value in values)


@dataclass(eq=False)
class LiveRun:
    """The stored events of a run up to now, with its parameters and configuration. `point` is the class of its points;
    `prediction` is empty until it is known.
    """

    point: type[Parameters]
    parameters: Any
    configuration: BenchConfiguration
    prediction: Table = field(default_factory=dict[str, Any])
    _kept: dict[type[Event], deque[Event]] = field(default_factory=dict[type[Event], deque[Event]], init=False)

    def follow(self, event: Event) -> bool:
        """Store an event; returns whether the view may have changed."""
        if isinstance(event, _ELSEWHERE):
            return False
        kind = type(event)
        if kind not in self._kept:
            limit = FITS if _is_large(event) else None if kind is PointFinished else KEPT
            self._kept[kind] = deque(maxlen=limit)
        self._kept[kind].append(event)
        return True

    def events(self, kind: type[E]) -> list[E]:
        """The stored events of this type, in order."""
        return [event for event in self._kept.get(kind, ()) if isinstance(event, kind)]

    @property
    def points(self) -> list[Parameters]:
        """The finished points, in order."""
        return [event.point for event in self.events(PointFinished)]

    @property
    def fits(self) -> list[FitFinished]:
        """The last `FITS` finished fits, in order."""
        return self.events(FitFinished)

    def column(self, field: str, points: Sequence[Parameters] | None = None) -> Array:
        """A field of all points or of the given `points`, shape (n,); NaN where it is None."""
        values = [getattr(point, field) for point in (self.points if points is None else points)]
        return np.array([np.nan if value is None else value for value in values], dtype=np.float64)

    def predicted(self, column: str) -> Array:
        """A column of the prediction, shape (n,); empty until the prediction is known."""
        found = self.prediction.get(column)
        return np.zeros(0) if found is None else found.values.astype(np.float64)


Live: TypeAlias = Callable[[LiveRun], LiveView]


def standard_view(run: LiveRun) -> LiveView:
    """View of a protocol that declares none: the first available of gains, last fit, response of the table and
    live values.
    """
    if "alpha_2" in run.point.model_fields or any("alpha_2" in type(point).model_fields for point in run.points):
        return (GainCurve(),)
    if run.fits:
        fit = run.fits[-1]
        (axis, along), *others = fit.columns.items()
        unit = others[0][1].unit if others else "1"
        return (Panel(fit.name, (axis, along.unit), ("", unit)).fit(fit),)
    if tables := run.events(TableIdentified):
        return (response_panel(tables[-1]),)
    values = run.events(LiveValue)
    panels = {value.unit: Panel("", ("bench time", "s"), ("", value.unit)) for value in values}
    for label in dict.fromkeys(value.label for value in values):
        own = [value for value in values if value.label == label]
        time = [value.time for value in own]
        panel = panels[own[-1].unit]
        panel.points(label, time, [value.value for value in own], [value.uncertainty for value in own])
        panel.predicted(f"{label}, predicted", time, [value.predicted for value in own])
    return tuple(panels.values()) or (Panel(""),)


def response_panel(table: TableIdentified | None) -> Panel:
    """Panel with the magnitude of the table's response against frequency, empty while `table` is None."""
    panel = Panel(
        "response of the table",
        ("frequency", "Hz"),
        ("response", "m/s2/V"),
        awaits="The response of the table appears here when all multisines have been played.",
        logarithmic="xy",
    )
    if table is not None:
        panel.line("response", table.frequency, np.hypot(table.real, table.imaginary))
    return panel
