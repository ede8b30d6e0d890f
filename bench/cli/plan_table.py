"""The tests of a queue as text: what their plans come to, and what became of them."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from bench.cli.refusal import error_object
from bench.cli.words import ABSENT, clock
from bench.report.text_table import TextColumn, text_table
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.preflight.compiled import Preflight
    from bench.queue.queued import Queued

_TESTS = (
    TextColumn("test"),
    TextColumn("state", words=True),
    TextColumn("protocol", words=True),
    TextColumn("results in", words=True),
    TextColumn("how it ended", words=True),
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


def tests_text(tests: "Sequence[Queued]") -> str:
    """One line for each test, and how many there are of each stage."""
    rows = [(str(n + 1), str(test.stage), test.protocol, test.out or ABSENT, test.told) for n, test in enumerate(tests)]
    counted = {stage: sum(test.stage == stage for test in tests) for stage in dict.fromkeys(t.stage for t in tests)}
    said = ", ".join(f"{number} {stage}" for stage, number in counted.items()) or "no tests"
    return f"{text_table(_TESTS, rows)}\n{said}."


def plans_text(
    tests: "Sequence[Queued]", found: "Mapping[int, Preflight]", refused: InvalidInput | None, *, as_json: bool
) -> str:
    """The plan of every test that waits, and in JSON why the queue is refused."""
    plans = [_plan(index + 1, tests[index], plan) for index, plan in found.items()]
    if as_json:
        error = {} if refused is None else {"error": error_object(refused)}
        return json.dumps({"tests": plans, **error}, allow_nan=False)
    return text_table(_PLANS, map(_row, plans))


def _plan(number: int, test: "Queued", found: "Preflight") -> dict[str, object]:
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
