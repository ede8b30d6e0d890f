"""Largest value of every limited quantity in a run of the simulated bench, against what its preflight stated."""

import contextlib
from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.guard.guard import Exchange, Guard
from bench.preflight.margins import bounds
from protocols.harmonic import plan

NAMES = {key: bound.name for key, bound in bounds(BenchConfiguration()).items()}
"""Name of each limited quantity in the preflight's table."""


@dataclass
class Demands:
    """Largest magnitudes in their SI units, by name in the preflight's table: of the whole run, and from the beginning
    of a hold until its point ends.
    """

    whole: dict[str, float] = field(default_factory=dict[str, float])
    held: dict[str, float] = field(default_factory=dict[str, float])
    holding: bool = False

    def note(self, magnitudes: dict[str, float]) -> None:
        for found in (self.whole, self.held) if self.holding else (self.whole,):
            for key, value in magnitudes.items():
                name = NAMES[key]
                found[name] = float(np.fmax(found.get(name, 0.0), value))


@contextlib.contextmanager
def demands_watched() -> Generator[Demands]:
    """Context in which the largest magnitudes of a run are kept."""
    demands = Demands()
    exchange, hold = Guard.exchange, plan.hold

    def exchanged(guard: Guard, volts: NDArray[np.float64]) -> Exchange:
        found = exchange(guard, volts)
        demands.note({**found.magnitudes(), "drive_voltage": float(np.max(np.abs(found.drive)))})
        return found

    def held(*arguments: Any) -> Generator[Any, Any, Any]:
        demands.holding = True
        result = yield from hold(*arguments)
        demands.holding = False
        return result

    with patch.object(Guard, "exchange", exchanged), patch.object(plan, "hold", held):
        yield demands


@dataclass(frozen=True)
class Stated:
    """Limit of a quantity in its SI unit and its margins: for the nominal specimen, and the margin that 95 % of the
    specimens keep.
    """

    limit: float
    margin: float
    likely: float


def stated_margins(file: Path) -> dict[str, Stated]:
    """Predicted margins that the preflight wrote to a campaign's file, by name of the quantity."""
    with open_datafile(file) as record:
        table = record.tables["preflight"]
        columns = (table[name].values.tolist() for name in ("quantity", "limit", "margin", "margin_95"))
        rows = list(zip(*columns, strict=True))
    return {name: Stated(limit, margin, likely) for name, limit, margin, likely in rows if not np.isnan(margin)}


@dataclass
class MarginCount:
    """Margins of several runs beside the stated ones, by part of the run and name of the quantity."""

    runs: int = 0
    found: dict[tuple[str, str], list[tuple[float, Stated]]] = field(
        default_factory=dict[tuple[str, str], list[tuple[float, Stated]]]
    )

    def add(self, demands: Demands, stated: dict[str, Stated]) -> None:
        self.runs += 1
        for part, largest in ("whole run", demands.whole), ("hold", demands.held):
            for name in largest.keys() & stated.keys():
                each = stated[name]
                self.found.setdefault((part, name), []).append((1.0 - largest[name] / each.limit, each))

    def rows(self) -> Generator[str]:
        """A line for each part and quantity, those with the least margin first in each part."""
        least = {key: min(margins, key=lambda one: one[0]) for key, margins in self.found.items()}
        for (part, name), (margin, stated) in sorted(least.items(), key=lambda one: (one[0][0] == "hold", one[1][0])):
            lacking = [each.likely - own for own, each in self.found[part, name] if own < each.likely]
            yield (
                f"{part}, {name}: least margin {100 * margin:.1f} %, stated there {100 * stated.margin:.1f} % and "
                f"{100 * stated.likely:.1f} % (95 % of the specimens); below the latter in {len(lacking)} of "
                f"{self.runs} runs" + (f", by {100 * max(lacking):.1f} points at most" if lacking else "")
            )
