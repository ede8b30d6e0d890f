"""Runs the parts of the benchmark and writes what they found: tables, JSON and a figure."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from bench.benchmark.machine import machine, versions
from bench.benchmark.section import Section, targets_section
from bench.progress import Progress, silent
from bench.report.files import write_new
from sim.errors import InvalidInput
from sim.loading import load_model

MARKDOWN, JSON, FIGURE = "benchmark.md", "benchmark.json", "work_precision.png"
RESULTS = (MARKDOWN, JSON, FIGURE)
"""The files of a benchmark."""


@dataclass(frozen=True)
class Scale:
    """How much is measured.

    `methods`: the contenders at all settings or at few; `budget` [s] of each. `map_points` along each axis of the map,
    of which `run_points` are run for 120 s. `members` of the scatter, `stream` [s] of streaming, `repetitions` of the
    growth, `warm` starts.
    """

    name: str
    all_methods: bool
    budget: float
    map_points: int
    run_points: int
    map_repetitions: int
    members: int
    stream: float
    repetitions: int
    warm: int


QUICK = Scale("quick", False, 0.25, 20, 6, 1, 100, 2.0, 4, 1)
FULL = Scale("full", True, 5.0, 100, 50, 3, 1000, 20.0, 20, 5)


def _work_precision(scale: Scale) -> Section:
    from bench.benchmark.work_precision import work_precision

    return work_precision(quick=not scale.all_methods, budget=scale.budget)


def _gain_map(scale: Scale) -> Section:
    from bench.benchmark.gain_map import gain_maps

    return gain_maps(scale.map_points, scale.run_points, scale.map_repetitions)


def _records(scale: Scale) -> Section:
    from bench.benchmark.records import records

    return records(quick=not scale.all_methods, members=scale.members)


def _streaming(scale: Scale) -> Section:
    from bench.benchmark.streaming import streaming

    return streaming(scale.stream, scale.repetitions, (1_000, 2_000, 20_000) if scale.all_methods else (1_000,))


def _steady_by_time(_: Scale) -> Section:
    from bench.benchmark.steady_by_time import steady_by_time

    return steady_by_time()


def _scaling(scale: Scale) -> Section:
    from bench.benchmark.scaling import scaling

    return scaling(scale.repetitions)


def _startup(scale: Scale) -> Section:
    from bench.benchmark.startup import startup

    return startup(scale.warm)


PARTS: dict[str, Callable[[Scale], Section]] = {
    "work_precision": _work_precision,
    "steady_by_time": _steady_by_time,
    "gain_map": _gain_map,
    "records": _records,
    "streaming": _streaming,
    "scaling": _scaling,
    "startup": _startup,
}
"""The parts by name, in their order."""


def run_benchmark(
    scale: Scale,
    out: Path,
    *,
    parts: Sequence[str] = tuple(PARTS),
    say: Callable[[str], None] = print,
    progress: Progress = silent,
) -> list[Section]:
    """Measure the `parts` and leave their results in the folder `out`, which is made if missing.

    Every table goes to `say` as soon as it is there. Returns the sections, the targets first.
    Raises InvalidInput when a result is there already or a part is unknown.
    """
    for name in parts:
        if name not in PARTS:
            raise InvalidInput("part", name, f"it must be one of {', '.join(PARTS)}")
    for name in RESULTS:
        if (out / name).exists():
            raise InvalidInput("out", str(out), f"it holds {name} already; results are never overwritten")
    load_model(progress)
    begin, started = time.perf_counter(), datetime.now().astimezone()
    sections: list[Section] = []
    for number, name in enumerate(parts):
        progress(f"measuring {name.replace('_', ' ')}, part {number + 1} of {len(parts)}", number, len(parts))
        section = PARTS[name](scale)
        sections.append(section)
        say(f"{section.text()}\n")
    sections.insert(0, targets_section(sections))
    say(f"{sections[0].text()}\n")
    context: dict[str, str | float | dict[str, str]] = {
        "scale": scale.name,
        "started": started.isoformat(timespec="seconds"),
        "elapsed_s": round(time.perf_counter() - begin, 1),
        "machine": machine(),
        "versions": versions(),
    }
    progress("writing the results")
    out.mkdir(parents=True, exist_ok=True)
    _write(out, context, sections)
    return sections


def _write(out: Path, context: Mapping[str, str | float | dict[str, str]], sections: list[Section]) -> None:
    from bench.benchmark.figure import work_precision_figure
    from bench.report.style import write_figure

    data: dict[str, object] = {**context, **{section.key: section.as_dict() for section in sections}}
    document = [f"# Benchmark ({context['scale']})", "", *_listed(context)]
    document += [part for section in sections for part in ("", section.markdown())]
    write_new(out / MARKDOWN, lambda path: _save(path, "\n".join(document) + "\n"))
    write_new(out / JSON, lambda path: _save(path, json.dumps(data, indent=1, allow_nan=False) + "\n"))
    for section in sections:
        if section.key == "work_precision":
            write_figure(out / FIGURE, work_precision_figure(section))


def _save(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _listed(context: Mapping[str, str | float | dict[str, str]]) -> list[str]:
    lines: list[str] = []
    for name, value in context.items():
        shown = ", ".join(f"{key} {item}" for key, item in value.items()) if isinstance(value, dict) else str(value)
        lines.append(f"- {name}: {shown}")
    return lines
