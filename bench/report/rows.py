"""Points of any protocol as plain dictionaries: what table, figure and summary work on."""

from collections.abc import Mapping, Sequence
from typing import Any

from sim.parameters import Parameters

PointLike = Parameters | Mapping[str, Any]
"""A point, or its fields as `bench.record.reader` gives them."""


def plain(points: Sequence[PointLike]) -> list[dict[str, Any]]:
    """One dictionary per point: numbers, truth values, texts, and None where a value is absent or NaN."""
    dicts = [point.model_dump(mode="json") if isinstance(point, Parameters) else dict(point) for point in points]
    return [{name: None if value != value else value for name, value in row.items()} for row in dicts]
