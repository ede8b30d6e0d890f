"""Sections of benchmark results, and the timing of runs."""

import gc
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from statistics import median
from typing import Any, Generic, TypeVar

from bench.figures.text_table import TextColumn, text_table

T = TypeVar("T")


@dataclass(frozen=True)
class Timing(Generic[T]):
    """Times [s] of repeated runs, and the result of the last one."""

    minimum: float
    median: float
    result: T


def once(run: Callable[[], T]) -> tuple[float, T]:
    """Time [s] and result of one run."""
    begin = time.perf_counter()
    result = run()
    return time.perf_counter() - begin, result


def timed(run: Callable[[], T], repetitions: int) -> Timing[T]:
    """Times of `repetitions` runs, which follow an untimed run."""
    run()
    return in_turn({"": (run, repetitions)})[""]


def in_turn(runs: Mapping[str, tuple[Callable[[], Any], int]]) -> dict[str, Timing[Any]]:
    """Time several functions, each with a number of repetitions; their runs are interleaved evenly. Garbage collection
    is disabled during the runs.
    """
    times: dict[str, list[float]] = {name: [] for name in runs}
    results: dict[str, Any] = {}
    collecting = gc.isenabled()
    gc.disable()
    try:
        rounds = max(count for _, count in runs.values())
        for turn in range(rounds):
            for name, (run, count) in runs.items():
                if (turn + 1) * count // rounds > turn * count // rounds:
                    elapsed, results[name] = once(run)
                    times[name].append(elapsed)
    finally:
        if collecting:
            gc.enable()
    return {name: Timing(min(times[name]), median(times[name]), results[name]) for name in runs}


Cell = float | int | str | bool | None


@dataclass(frozen=True)
class Column:
    """A table column: key in the rows, heading with unit, number format."""

    key: str
    heading: str
    form: str = "s"


@dataclass(frozen=True)
class Target:
    """A performance target, met when `measured` is at most `limit`; `measured` is None when it could not be
    measured. `bound` states what limits a target that may be missed.
    """

    name: str
    limit: float
    measured: float | None
    unit: str
    bound: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None when not measured."""
        return None if self.measured is None else self.measured <= self.limit

    def row(self) -> dict[str, Cell]:
        """The target as a row of a table."""
        return {
            "name": self.name,
            "limit": self.limit,
            "measured": self.measured,
            "unit": self.unit,
            "met": self.met,
        }


@dataclass(frozen=True)
class Section:
    """One table with its notes."""

    key: str
    title: str
    columns: Sequence[Column]
    rows: Sequence[dict[str, Cell]]
    notes: Sequence[str] = ()
    targets: Sequence[Target] = field(default=())

    def text(self) -> str:
        """The section as plain text, with aligned columns."""
        columns = [TextColumn(column.heading, words=column.form == "s") for column in self.columns]
        return "\n".join([self.title, "", text_table(columns, self._cells()), *self.notes])

    def markdown(self) -> str:
        """The section as Markdown."""
        head = [column.heading for column in self.columns]
        rule = ["---" if column.form == "s" else "--:" for column in self.columns]
        lines = ["| " + " | ".join(line) + " |" for line in (head, rule, *self._cells())]
        return "\n".join([f"## {self.title}", "", *lines, *(f"\n{note}" for note in self.notes)])

    def as_dict(self) -> dict[str, object]:
        """Plain data for JSON; values that are not finite are None."""
        rows = [
            {name: None if isinstance(cell, float) and not isfinite(cell) else cell for name, cell in row.items()}
            for row in self.rows
        ]
        return {"title": self.title, "rows": rows, "notes": list(self.notes)}

    def _cells(self) -> list[list[str]]:
        return [[_shown(row.get(column.key), column.form) for column in self.columns] for row in self.rows]


TARGET_COLUMNS = (
    Column("name", "target"),
    Column("limit", "at most", "g"),
    Column("measured", "measured", ".3g"),
    Column("unit", "unit"),
    Column("met", "met"),
)


def targets_section(sections: Sequence[Section]) -> Section:
    """All targets in one table, missed targets first, with what limits them."""
    targets = [target for section in sections for target in section.targets]
    order = {False: 0, None: 1, True: 2}
    rows = [target.row() for target in sorted(targets, key=lambda target: order[target.met])]
    notes = [
        f"Missed: {target.name}. {target.bound or 'The cause is not known.'}"
        for target in targets
        if target.met is False
    ]
    return Section("targets", "Targets", TARGET_COLUMNS, rows, notes)


def _shown(value: Cell, form: str) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, str) or form == "s":
        return str(value)
    return format(value, form) if isfinite(value) else "-"
