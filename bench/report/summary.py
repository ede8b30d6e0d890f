"""The summary of a campaign for programs: one JSON file with every point and where the rest lies."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, cast

from bench.report.files import write_new
from bench.report.rows import PointLike, plain


@dataclass(frozen=True)
class Summary:
    """What the summary says. Times are seconds: `elapsed` on the wall, `bench_time` on the bench's clock.

    `plan_hash` is that of the preflight (docs/preflight.md). `findings` is what a protocol makes of its points.
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
        """Ready for JSON: enumerations as their text, NaN and infinity as null, paths with forward slashes."""
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
        return {key: _clean(value) for key, value in content.items()}


def write_summary(path: Path, summary: Summary) -> None:
    """Write the summary as JSON. Raises InvalidInput when `path` exists, RockbenchError when the disk fails."""
    text = json.dumps(summary.as_dict(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    write_new(path, lambda unfinished: _write_utf8(unfinished, text))


def _write_utf8(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _clean(value: Any) -> Any:
    if isinstance(value, Enum):
        return _clean(value.value)
    if isinstance(value, float):
        # float() turns a scalar of numpy, which is a float, into one that prints like any other
        return float(value) if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _clean(item) for key, item in cast(dict[Any, Any], value).items()}
    if isinstance(value, list | tuple):
        return [_clean(item) for item in cast(list[Any], value)]
    return value
