"""The uncertainty of alpha_2 as a budget: named standard uncertainties, largest first."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot

COVERAGE = 2.0
"""Coverage factor k of every stated uncertainty."""


@dataclass(frozen=True)
class Budget:
    """Independent contributions to one result: standard uncertainties in its unit, by name."""

    parts: Mapping[str, float]

    @property
    def largest_first(self) -> dict[str, float]:
        """The same, sorted."""
        return dict(sorted(self.parts.items(), key=lambda part: -part[1]))

    @property
    def expanded(self) -> float:
        """Expanded uncertainty (k = 2)."""
        return COVERAGE * hypot(*self.parts.values())

    @property
    def dominating(self) -> str:
        """The largest contribution; empty where there is none above zero."""
        name, value = next(iter(self.largest_first.items()), ("", 0.0))
        return name if value > 0.0 else ""

    @property
    def as_json(self) -> str:
        """All contributions, largest first, for a file."""
        return json.dumps({name: float(f"{value:.3g}") for name, value in self.largest_first.items()})
