"""Largest value of every limited quantity in a run of the simulated bench, against what its preflight stated."""

import contextlib
from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import h5py
import numpy as np
from numpy.typing import NDArray

from bench.guard.guard import Exchange, Guard
from bench.guard.motion import WATCHED
from protocols.harmonic import plan
from sim.channel import STOREYS

NAMES = {key: name for key, (name, _) in WATCHED.items() if key != "laser_range"} | {
    "drive_voltage": "drive",
    **{name: f"fraction of laser {number}'s half range" for number, name in enumerate(STOREYS, start=1)},
}
"""Name in the preflight's table of each quantity that the guard displays, and of the drive."""


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
    with h5py.File(file) as opened:
        table: Any = opened["entry/preflight"]
        columns = (table[name][:].tolist() for name in ("quantity", "limit", "margin", "margin_95"))
        rows = [
            (name.decode(), Stated(limit, margin, likely)) for name, limit, margin, likely in zip(*columns, strict=True)
        ]
    return {name: stated for name, stated in rows if not np.isnan(stated.margin)}


@dataclass
class MarginCount:
    """Margins of several runs against the stated ones."""

    runs: int = 0
    below: dict[str, dict[str, list[float]]] = field(default_factory=dict[str, dict[str, list[float]]])
    least: dict[str, dict[str, tuple[float, Stated]]] = field(
        default_factory=dict[str, dict[str, tuple[float, Stated]]]
    )

    def add(self, demands: Demands, stated: dict[str, Stated]) -> None:
        self.runs += 1
        for part, found in ("whole run", demands.whole), ("hold", demands.held):
            for name, each in stated.items():
                if name not in found:
                    continue
                margin = 1.0 - found[name] / each.limit
                lacking = self.below.setdefault(part, {}).setdefault(name, [])
                if margin < each.likely:
                    lacking.append(each.likely - margin)
                least = self.least.setdefault(part, {})
                if name not in least or margin < least[name][0]:
                    least[name] = margin, each

    def rows(self) -> Generator[str]:
        for part, found in self.least.items():
            for name, (margin, stated) in sorted(found.items(), key=lambda item: item[1][0]):
                lacking = self.below[part][name]
                yield (
                    f"{part}, {name}: least margin {100 * margin:.1f} %, stated there {100 * stated.margin:.1f} % and "
                    f"{100 * stated.likely:.1f} % (95 % of the specimens); below the latter in {len(lacking)} of "
                    f"{self.runs} runs" + (f", by {100 * max(lacking):.1f} points at most" if lacking else "")
                )
