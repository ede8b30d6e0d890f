"""`--dry-run`: what a run would ask of the bench, the limit that binds, and the margin to each; nothing is opened."""

import json
import sys
import textwrap
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.refusal import error_object, tell
from bench.cli.words import ABSENT, clock
from bench.progress import Progress
from bench.report.text_table import TextColumn, text_table

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.preflight.compiled import Preflight
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


def dry_run(
    protocol: "Protocol[Any]",
    parameters: "Parameters",
    configuration: "BenchConfiguration",
    out: Path,
    progress: Progress,
    *,
    as_json: bool,
) -> int:
    """Print the preflight on standard output. Returns 0 when the run may begin, 2 when it is refused."""
    progress("loading the program")
    from bench.preflight.compiled import compile_run, prepare

    # standard output belongs to the result
    with redirect_stdout(sys.stderr):
        prepared = prepare(protocol, parameters, configuration, progress)
        found = compile_run(protocol.name, prepared, out, progress)
    print(json.dumps(_content(found), allow_nan=False) if as_json else _text(found))
    if found.refusal is not None:
        tell(found.refusal)
        return 2
    return 0


def _content(found: "Preflight") -> dict[str, Any]:
    refused, room = found.refusal, found.room
    return {
        "would_run": refused is None,
        "refused": None if refused is None else str(refused),
        **({} if refused is None else {"error": error_object(refused)}),
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
    lines = [_margins(found.margins)] if found.margins else ["This protocol predicts no margins."]
    if found.margins:
        binding = found.margins[0]
        lines += ["", f"Tightest: {binding.bound.name}, limited by {binding.bound.owner}."]
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
        lines.append(f"Disk: {found.room.needed / 1e6:.0f} MB may be needed, {found.room.free / 1e6:.0f} MB are free")
    return "\n".join([*lines, f"Plan: {found.plan_hash}"])


def _margins(margins: "tuple[Margin, ...]") -> str:
    """Tightest first; "95 %" is for the specimens within the uncertainty."""

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
