"""The same points of two runs beside each other. Knows nothing of Qt."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, nan
from typing import Any

from bench.gui import texts
from bench.gui.gain_lines import Mark, mark_of


@dataclass(frozen=True)
class Difference:
    """A point in the reference and in another run; a gain that was not measured is None.

    `uncertainty` is that of the difference, expanded (k = 2), the two taken as independent; NaN without both.
    """

    point: str
    reference: float | None
    other: float | None
    uncertainty: float

    @property
    def value(self) -> float:
        """The other gain less that of the reference; NaN without both."""
        return nan if self.reference is None or self.other is None else self.other - self.reference

    @property
    def score(self) -> float:
        """|difference| over its uncertainty, the E_n score of ISO 13528: above 1 the runs differ. NaN where
        either is not known.
        """
        return abs(self.value) / self.uncertainty if self.uncertainty > 0.0 else nan


def compare(reference: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> list[Difference]:
    """Every point of either run, those of the reference first, in their order.

    Of a point that a run measured several times the last counts. Uncertainties are those of the points (k = 2),
    combined as the root of the sum of squares.
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
    if first is not None and second is not None and None not in gains:
        spread = hypot(first.spread, second.spread)
    if isinstance(known.group, str):
        point = texts.RECORD_POINT.format(record=known.group, beta=known.x)
    else:
        point = texts.SINE_POINT.format(omega=known.x, beta=known.group)
    return Difference(point, gains[0], gains[1], spread)
