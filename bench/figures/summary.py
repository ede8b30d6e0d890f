"""Summary of a campaign as a JSON file: all points, and the paths of the other results."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, cast

from bench.unfinished import write_new
from sim.parameters import Parameters

PointLike = Parameters | Mapping[str, Any]
"""A point, or its fields as returned by `bench.datafile.reader`."""


def plain(points: Sequence[PointLike]) -> list[dict[str, Any]]:
    """One dictionary per point: numbers, Booleans, strings, and None where a value is absent or NaN."""
    dicts = [point.model_dump(mode="json") if isinstance(point, Parameters) else dict(point) for point in points]
    return [{name: None if value != value else value for name, value in row.items()} for row in dicts]


@dataclass(frozen=True)
class Summary:
    """Contents of the summary.

    elapsed, bench_time : duration by the wall clock and by the bench's clock [s].
    plan_hash : hash of the plan, computed in the preflight (docs/preflight.md).
    findings : the protocol's conclusions from its points.
    """

    protocol: str
    status: str
    points: Sequence[PointLike]
    file: Path | None
    figure: Path | None
    reason: str
    software: str
    seed: int | None
    elapsed: float
    bench_time: float
    plan_hash: str | None = None
    further_figures: Sequence[Path] = ()
    findings: Mapping[str, object] = field(default_factory=dict[str, object])

    def as_dict(self) -> dict[str, Any]:
        """Contents for JSON: enumerations as their values, NaN and infinity as null, paths with forward slashes."""
        content: dict[str, Any] = {
            "protocol": self.protocol,
            "status": self.status,
            "reason": self.reason,
            "points": plain(self.points),
            "file": None if self.file is None else self.file.as_posix(),
            "figure": None if self.figure is None else self.figure.as_posix(),
            "software": self.software,
            "seed": self.seed,
            "elapsed_s": self.elapsed,
            "bench_time_s": self.bench_time,
        }
        if self.plan_hash is not None:
            content["plan_hash"] = self.plan_hash
        if self.further_figures:
            content["further_figures"] = [path.as_posix() for path in self.further_figures]
        content |= self.findings
        return {key: json_ready(value) for key, value in content.items()}


def write_summary(path: Path, summary: Summary) -> None:
    """Writes the summary as JSON. Raises InvalidInput if `path` exists and RockbenchError if it cannot be written."""
    text = json.dumps(summary.as_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def write(unfinished: Path) -> None:
        unfinished.write_text(text, encoding="utf-8", newline="\n")

    write_new(path, write)


def json_ready(value: Any) -> Any:
    """Value for JSON: an enumeration as its value, a non-finite number as None."""
    if isinstance(value, Enum):
        return json_ready(value.value)
    if isinstance(value, float):
        # numpy.float64 is a subclass of float
        return float(value) if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): json_ready(item) for key, item in cast(dict[Any, Any], value).items()}
    if isinstance(value, list | tuple):
        return [json_ready(item) for item in cast(list[Any], value)]
    return value
