"""The points of a campaign, each with its status, result and expected end."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from math import isfinite
from typing import Any

from bench.app.display import texts
from bench.app.formatting import number
from bench.app.ipc.messages import Run
from bench.datafile.tables import Table
from bench.events import Event, PointFinished
from bench.live_values import Estimate, RunningGain
from bench.protocol import Axis, Protocol

Place = tuple[int, int]
"""Row and column of a point in the matrix."""


@dataclass
class Cell:
    """A point: its status, as reported by the protocol or one of `texts.POINT_*`, and its result as text."""

    status: str = texts.POINT_WAITS
    result: str = ""


class Campaign:
    """The points of a run in the order of its parameters. `rows` and `columns` are the values of the two parameters
    that span the matrix, or the names that the prediction gives to these values.
    """

    def __init__(self, protocol: Protocol[Any], run: Run) -> None:
        self._axes, self._by_columns = protocol.view.matrix, protocol.view.by_columns
        self._headline, self._paced = protocol.view.headline, run.paced
        self.rows, self.columns = ([], []) if self._axes is None else (self._values(axis, run) for axis in self._axes)
        self.cells: dict[Place, Cell] = {}
        self.current: Place | None = None
        self.name_points({})

    def name_points(self, prediction: Table) -> None:
        """Replace the values of each axis of strings with the names in the prediction, in its order, and reset all
        points. Results identify a record by its name, whereas the parameter may be a file path or empty.
        """
        for axis, values in zip(self._axes or (), (self.rows, self.columns), strict=False):
            column = prediction.get(axis.field)
            if column is not None and column.values.dtype.kind == "U":
                values[:] = list(dict.fromkeys(column.values.tolist()))
        self.cells = {(i, j): Cell() for i in range(len(self.rows)) for j in range(len(self.columns))}

    @property
    def waiting(self) -> list[Place]:
        """Points that have not begun, in the order in which they are measured."""
        found = [place for place, cell in self.cells.items() if cell.status == texts.POINT_WAITS]
        return sorted(found, key=lambda place: place[::-1]) if self._by_columns else found

    def follow(self, event: Event) -> None:
        """Update the points with an event."""
        if self._axes is None:
            return
        match event:
            case Estimate(omega=omega, beta=beta):
                self._measure({"omega_rad_s": omega, "beta": beta})
            case RunningGain(record=record, beta=beta):
                self._measure({"record": record, "beta": beta})
            case PointFinished():
                point = event.point.model_dump()
                place = self._place(point)
                if place is not None:
                    value = point.get(self._headline)
                    self.cells[place] = Cell(str(point.get("status") or texts.POINT_DONE), _short(value))
                self.current = None
            case _:
                pass

    def end(self) -> None:
        """End the measurement of the current point without a result."""
        if self.current is not None and self.cells[self.current].status == texts.POINT_MEASURED:
            self.cells[self.current] = Cell()
        self.current = None

    def expected(self, place: Place, remaining: float, now: datetime) -> datetime | None:
        """Estimated end of a point, on the assumption that all unfinished points take equal parts of the `remaining`
        time [s]; None for a finished point, if `remaining` is not finite, or if the bench does not run in real time,
        because `remaining` is its own time.
        """
        left = [*([] if self.current is None else [self.current]), *self.waiting]
        if place not in left or not isfinite(remaining) or not self._paced:
            return None
        return now + timedelta(seconds=remaining * (left.index(place) + 1) / len(left))

    def _measure(self, at: Mapping[str, Any]) -> None:
        place = self._place(at)
        if place != self.current:
            self.end()
            self.current = place
        if place is not None:
            self.cells[place] = Cell(texts.POINT_MEASURED)

    def _place(self, point: Mapping[str, Any]) -> Place | None:
        assert self._axes is not None
        found = [
            # a running value need not state a parameter that has a single value
            0
            if len(values) == 1 and axis.field not in point
            else next((k for k, value in enumerate(values) if _same(value, point.get(axis.field))), None)
            for axis, values in zip(self._axes, (self.rows, self.columns), strict=True)
        ]
        return None if found[0] is None or found[1] is None else (found[0], found[1])

    def _values(self, axis: Axis, run: Run) -> list[object]:
        values = getattr(run.parameters, axis.parameter)
        return [*values] if isinstance(values, tuple) else [values]


def _short(value: object) -> str:
    return number(value) if isinstance(value, float) else ""


def _same(value: object, other: object) -> bool:
    if isinstance(value, float) and isinstance(other, float | int):
        return abs(value - other) <= 1e-9 * max(abs(value), 1.0)
    return value == other
