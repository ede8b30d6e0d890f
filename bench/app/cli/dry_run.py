"""`--dry-run` of a run or a queue: prints the demands on the bench and the margin to each limit, without opening a
device.
"""

import sys
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.app.cli.output import print_error, print_result
from bench.app.formatting import ABSENT, clock
from bench.figures.text_table import TextColumn, text_table
from bench.progress import Progress

if TYPE_CHECKING:
    from bench.app.preflight import Preflight
    from bench.app.queue.queue import Queued
    from bench.config.model import BenchConfiguration
    from bench.preflight.margins import Margin
    from bench.protocol import Protocol
    from sim.parameters import Parameters

WIDTH = 120

_MARGINS = (
    TextColumn("quantity", words=True),
    TextColumn("unit", words=True),
    TextColumn("demand"),
    TextColumn("at 95 %"),
    TextColumn("limit"),
    TextColumn("margin", "%"),
    TextColumn("at 95 %", "%"),
    TextColumn("where", words=True),
)
_TESTS = (
    TextColumn("test"),
    TextColumn("state", words=True),
    TextColumn("protocol", words=True),
    TextColumn("results in", words=True),
    TextColumn("outcome", words=True),
)
_PLANS = (
    TextColumn("test"),
    TextColumn("protocol", words=True),
    TextColumn("duration"),
    TextColumn("tightest", words=True),
    TextColumn("margin", "%"),
    TextColumn("disk", "MB"),
    TextColumn("", words=True),
)


def dry_run(
    protocol: "Protocol[Any]",
    parameters: "Parameters",
    configuration: "BenchConfiguration",
    out: Path,
    progress: Progress,
    *,
    as_json: bool,
) -> int:
    """Print the preflight on standard output; returns 0 if the run may begin, 2 if it is refused."""
    progress("loading the program")
    from bench.app.preflight import compile_run, prepare

    # standard output is reserved for the result
    with redirect_stdout(sys.stderr):
        prepared = prepare(protocol, parameters, configuration, progress)
        found = compile_run(protocol.name, prepared, out, progress)
    print_result(lambda: _content(found), lambda: _text(found), as_json=as_json, error=found.refusal)
    if found.refusal is not None:
        print_error(found.refusal)
        return 2
    return 0


def _content(found: "Preflight") -> dict[str, Any]:
    refused, room = found.refusal, found.room
    return {
        "would_run": refused is None,
        "refused": None if refused is None else str(refused),
        "warnings": list(found.warnings),
        "margins": [
            {
                "quantity": each.bound.quantity,
                "name": each.bound.name,
                "unit": each.bound.unit,
                "demand": each.demand.value,
                "demand_95": each.demand.likely,
                "limit": each.bound.limit,
                "owner": each.bound.owner,
                "margin": each.margin,
                "margin_95": each.likely,
                "where": each.demand.where,
            }
            for each in found.margins
        ],
        "starts": [
            {"name": stage.name, "chance": stage.chance} for stage in found.forecast.stages if stage.chance is not None
        ],
        "notes": list(found.notes),
        "duration_s": found.forecast.duration,
        "disk": None if room is None else {"needed_bytes": room.needed, "free_bytes": room.free},
        "plan_hash": found.plan_hash,
    }


def _text(found: "Preflight") -> str:
    lines = [_margins(found.margins)] if found.margins else ["This protocol does not predict margins."]
    if found.margins:
        binding = found.margins[0]
        lines += ["", f"Tightest margin: {binding.bound.name}, limited by {binding.bound.owner}."]
    lines += [f"Warning: {warning}" for warning in found.warnings]
    chances = [(stage.name, stage.chance) for stage in found.forecast.stages if stage.chance is not None]
    if chances:
        rows = ((name, f"{chance:.0%}") for name, chance in chances)
        lines += ["", text_table((TextColumn("start", words=True), TextColumn("chance")), rows), ""]
    for note in found.notes:
        lines += textwrap.wrap(note, WIDTH, subsequent_indent="    ")
    if found.forecast.duration is not None:
        lines.append(f"Expected duration: {clock(found.forecast.duration)}")
    if found.room is not None:
        lines.append(f"Disk: up to {found.room.needed / 1e6:.0f} MB needed, {found.room.free / 1e6:.0f} MB free")
    return "\n".join([*lines, f"Plan: {found.plan_hash}"])


def _margins(margins: "tuple[Margin, ...]") -> str:
    """Table of margins, tightest first. A margin in the column "at 95 %" is kept with a probability of 95 %, given the
    uncertainty of the specimen.
    """

    def number(value: float | None) -> str:
        return ABSENT if value is None else f"{value:.4g}"

    def share(value: float | None) -> str:
        return ABSENT if value is None else f"{100.0 * value:.1f}"

    rows = (
        (
            each.bound.name,
            each.bound.unit,
            number(each.demand.value),
            number(each.demand.likely),
            number(each.bound.limit),
            share(each.margin),
            share(each.likely),
            each.demand.where,
        )
        for each in margins
    )
    return text_table(_MARGINS, rows)


def tests_text(tests: "Sequence[Queued]") -> str:
    """Table with one row for each test, and the number of tests in each state."""
    rows = [
        (str(n + 1), str(test.stage), test.protocol, test.out or ABSENT, test.outcome) for n, test in enumerate(tests)
    ]
    counted = {stage: sum(test.stage == stage for test in tests) for stage in dict.fromkeys(t.stage for t in tests)}
    said = ", ".join(f"{number} {stage}" for stage, number in counted.items()) or "no tests"
    return f"{text_table(_TESTS, rows)}\n{said}."


def plans_text(plans: "Sequence[Mapping[str, object]]") -> str:
    """Table with one row for each plan of a queue, from its `plan_content`."""
    return text_table(_PLANS, map(_row, plans))


def plan_content(number: int, test: "Queued", found: "Preflight") -> dict[str, object]:
    """The checked plan of a queued test, as content for JSON."""
    tightest = found.margins[0] if found.margins else None
    return {
        "test": number,
        "protocol": test.protocol,
        "would_run": found.refusal is None,
        "refused": None if found.refusal is None else str(found.refusal),
        "duration_s": found.forecast.duration,
        "tightest": None if tightest is None else tightest.bound.name,
        "margin": None if tightest is None else tightest.margin,
        "needed_bytes": None if found.room is None else found.room.needed,
        "warnings": list(found.warnings),
    }


def _row(plan: Mapping[str, object]) -> tuple[str, ...]:
    duration, margin, needed = plan["duration_s"], plan["margin"], plan["needed_bytes"]
    return (
        str(plan["test"]),
        str(plan["protocol"]),
        clock(duration) if isinstance(duration, float) else ABSENT,
        str(plan["tightest"] or ABSENT),
        f"{100.0 * margin:.1f}" if isinstance(margin, float) else ABSENT,
        f"{needed / 1e6:.0f}" if isinstance(needed, int) else ABSENT,
        "" if plan["would_run"] else "REFUSED",
    )
