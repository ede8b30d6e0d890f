# pyright: reportUnknownMemberType=false
"""Runs the parts of the benchmark and writes the results: tables, a JSON file that also describes the machine,
and the work-precision figure.
"""

import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.app.benchmark.section import Section, targets_section
from bench.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, new_figure, set_grid
from bench.progress import Progress, silent
from bench.provenance import software
from bench.unfinished import write_new
from sim.errors import InvalidInput
from sim.loading import RECORDS, load_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES: dict[str, tuple[str, str, Any]] = {
    "taylor": (BLUE, "o", "-"),
    "taylor, no peaks": (BLUE, "P", "-"),
    "heyoka": (VERMILLION, "s", "-"),
    "heyoka, with peaks": (VERMILLION, "D", "-"),
    "paper": (BLACK, "X", "-"),
    "rk4-located": (GREY, "v", (0, (4, 1.5))),
    "CVODE Adams": (PURPLE, "^", (0, (1, 1))),
    "scipy DOP853": (GREEN, "o", (0, (6, 1.5))),
    "scipy DOP853, Python": (GREEN, "P", "none"),
    "scipy RK45": (GREEN, "s", (0, (2, 2))),
    "scipy LSODA": (ORANGE, "^", (0, (1, 1))),
    "scipy Radau": (SKY, "v", (0, (4, 1.5))),
}
"""Colour, marker and dashes of each method; all other methods have grey points."""


def work_precision_figure(section: Section) -> "Figure":
    """Shortest run time against the error of the end state, one line per method; failed methods are omitted."""
    figure = new_figure(7.6, 5.2)
    panel = figure.add_subplot(1, 1, 1)
    good = [row for row in section.rows if row["status"] == "ok"]
    for name in dict.fromkeys(str(row["method"]) for row in good):
        places = sorted(
            (float(row["error"] or 0.0), float(row["min_ms"] or 0.0)) for row in good if row["method"] == name
        )
        colour, marker, dashes = STYLES.get(name, (GREY, ".", "none"))
        panel.plot(
            [error for error, _ in places],
            [elapsed for _, elapsed in places],
            color=colour,
            marker=marker,
            linestyle=dashes,
            linewidth=1.6 if name == "taylor" else 1.1,
            markersize=6.5,
            markeredgecolor="white",
            markeredgewidth=0.6,
            zorder=4 if name == "taylor" else 3,
            label=name,
        )
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlabel("error of the end state, largest component  [SI units]")
    panel.set_ylabel("shortest run time  [ms]")
    panel.set_title(r"120 s of steady rocking, 649 impacts ($\Omega$ = 17 rad/s, $\beta$ = 0.64)", fontsize=10)
    set_grid(panel)
    figure.legend(loc="outside right upper", fontsize=8, frameon=False, title="method", title_fontsize=8)
    return figure


PEERS = ("heyoka", "scikit-sundae", "mpmath")
"""Libraries used only by the benchmark."""


def machine() -> dict[str, str]:
    """Processor, number of cores and operating system."""
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
    }


def versions() -> dict[str, str]:
    """Versions of the software and of the installed comparison libraries."""
    return software() | {name: _version(name) for name in ("llvmlite", *PEERS)}


def _processor() -> str:
    try:
        # the only source of the full name on Linux
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


MARKDOWN, JSON, FIGURE = "benchmark.md", "benchmark.json", "work_precision.png"
RESULTS = (MARKDOWN, JSON, FIGURE)
"""Names of the result files."""


@dataclass(frozen=True)
class Scale:
    """Extent of the measurements.

    budget : approximate run time of each method [s].
    map_points, run_points : points along each axis of the map, and those of them that are also run for 120 s.
    members : number of specimens in the scatter case.
    stream : duration of the streamed motion [s].
    repetitions : number of runs at each size in the growth measurements.
    cold, warm : numbers of starts with an empty and with a filled compiler cache.
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
    cold: int
    warm: int


QUICK = Scale("quick", False, 0.25, 20, 6, 1, 100, 2.0, 4, 1, 1)
FULL = Scale("full", True, 5.0, 100, 50, 3, 1000, 20.0, 20, 3, 5)


def _work_precision(scale: Scale) -> Section:
    from bench.app.benchmark.work_precision import work_precision

    return work_precision(quick=not scale.all_methods, budget=scale.budget)


def _gain_map(scale: Scale) -> Section:
    from bench.app.benchmark.records import gain_maps

    return gain_maps(scale.map_points, scale.run_points, scale.map_repetitions)


def _records(scale: Scale) -> Section:
    from bench.app.benchmark.records import records

    return records(quick=not scale.all_methods, members=scale.members)


def _streaming(scale: Scale) -> Section:
    from bench.app.benchmark.scaling import streaming

    return streaming(scale.stream, scale.repetitions, (1_000, 2_000, 20_000) if scale.all_methods else (1_000,))


def _steady_by_time(_: Scale) -> Section:
    from bench.app.benchmark.work_precision import steady_by_time

    return steady_by_time()


def _scaling(scale: Scale) -> Section:
    from bench.app.benchmark.scaling import scaling

    return scaling(scale.repetitions)


def _startup(scale: Scale) -> Section:
    from bench.app.benchmark.scaling import startup

    return startup(scale.cold, scale.warm)


def _members(scale: Scale) -> Section:
    from bench.app.benchmark.members import members

    return members(scale.repetitions)


def _arithmetic(scale: Scale) -> Section:
    from bench.app.benchmark.arithmetic import arithmetic

    return arithmetic(scale.repetitions)


def _commands(scale: Scale) -> Section:
    from bench.app.benchmark.commands import commands

    return commands(quick=not scale.all_methods)


PARTS: dict[str, Callable[[Scale], Section]] = {
    "work_precision": _work_precision,
    "steady_by_time": _steady_by_time,
    "gain_map": _gain_map,
    "records": _records,
    "members": _members,
    "arithmetic": _arithmetic,
    "streaming": _streaming,
    "scaling": _scaling,
    "startup": _startup,
    "commands": _commands,
}
"""The parts of the benchmark by name, in order."""


def run_benchmark(
    scale: Scale,
    out: Path,
    *,
    parts: Sequence[str] = tuple(PARTS),
    say: Callable[[str], None] = print,
    progress: Progress = silent,
) -> list[Section]:
    """Run the `parts` and write their results to the folder `out`, which is created if missing.

    Every table is passed to `say` when complete. Returns the sections, the targets first. Raises InvalidInput if a
    result file exists or a part is unknown.
    """
    for name in parts:
        if name not in PARTS:
            raise InvalidInput("part", name, f"it must be one of {', '.join(PARTS)}")
    for name in RESULTS:
        if (out / name).exists():
            raise InvalidInput(
                "out", str(out), f"it already contains {name}; results are never overwritten, so choose another folder"
            )
    load_model(progress, RECORDS)
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
    from bench.figures.style import write_figure

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
