"""`rockbench replay`: a recorded campaign through the same engine, analysis and screens, compared with its file."""

import json
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from bench.cli.interrupt import answer
from bench.cli.progress import Handed
from bench.cli.prose import prose
from bench.cli.refusal import error_object, tell
from bench.cli.words import one_line
from bench.progress import silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.replaying.session import Replayed
    from drivers.clock import Clock

MAX = "max"

MOST_TOLD = 12
"""Differences that are told one by one."""


def replay_app() -> App:
    """`rockbench replay`."""
    app = App(name="replay", help=prose(replay), version_flags=())
    app.default(replay)
    return app


def replay(
    file: Annotated[Path, Parameter(name="FILE", help="File of a campaign (campaign.h5).")],
    /,
    *,
    speed: Annotated[str, Parameter(metavar="FACTOR", help="Pace: 1 as it was, 10 ten times as fast, or max.")] = MAX,
    as_json: Annotated[
        bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object, nothing else.")
    ] = False,
    progress: Handed = silent,
) -> int:
    """Play a recorded campaign again: its blocks through the same engine, guard, analysis and screens.

    The stored plan is carried out on the stored blocks, which lead it along the same path; questions are answered as
    they were, an end that was asked for is asked for again. No device is opened and no other file is read. Every drive
    sample, journal entry and result is compared with the file.

    The exit code is 0 when everything came as recorded but for rounding, also where a recording breaks off; 1 when
    something differs, which is told; 2 when the file cannot be played; 130 after Ctrl-C.
    """
    progress("loading the program")
    from bench.cli.console import progress_on
    from bench.cli.recorded import parameters_of, protocol_of
    from bench.preflight.compiled import load_bench
    from bench.record.reader import open_record
    from bench.replaying.session import replay as play
    from bench.replaying.session import stored_configuration
    from bench.session import result_of

    clock = _clock(speed)
    with open_record(file) as record:
        protocol = protocol_of(record)
        configuration, parameters = stored_configuration(record), parameters_of(record, protocol)
        try:
            load_bench(configuration, progress)
            progress("replaying the file")
            with progress_on(sys.stderr, False, protocol) as display, redirect_stdout(sys.stderr):
                prepared = protocol.prepare(parameters, configuration, record.tables)
                replayed = play(record, prepared.plan(), configuration, clock=clock, subscribers=[display])
        except KeyboardInterrupt:
            answer("the replay was interrupted")
            return 130
        result = result_of(replayed.returned, prepared, replayed.points)
        print(json.dumps(_content(file, replayed)) if as_json else _text(replayed, result.text))
    if not replayed.agrees:
        tell(_different(file, replayed))
        return 1
    return 0


def _clock(speed: str) -> "Clock":
    from drivers.clock import VirtualClock

    if speed == MAX:
        return VirtualClock()
    from bench.config.numbers import read_number
    from bench.replaying.pace import PacedClock

    allowed = f"a number from 0.01 to 1000, or {MAX}"
    try:
        factor = read_number(speed)
    except ValueError as error:
        raise InvalidInput("--speed", speed, str(error) or allowed) from None
    if not 0.01 <= factor <= 1000.0:
        raise InvalidInput("--speed", speed, allowed)
    return PacedClock(factor)


def _text(replayed: "Replayed", table: str) -> str:
    lines = [table.rstrip(), "", f"The replay was {replayed.status}: {replayed.reason}"]
    if replayed.ended is not None:
        lines.append(f"The recording breaks off: {replayed.ended}")
    lines += [f"Not in the samples, an abort was asked for in its place: {reason}" for reason in replayed.in_place]
    compared = ", ".join(f"{count} {part}" for part, count in replayed.found.compared.items() if count)
    if replayed.identical:
        there = " up to there" if replayed.ended is not None else ""
        lines.append(f"Identical to the file in every bit{there}: {compared}")
        return "\n".join(lines)
    differences = sorted(replayed.found.differences, key=lambda each: each.rounding)
    lines.append(f"Compared with the file: {compared}")
    lines += [("Rounding: " if each.rounding else "Differs: ") + each.text for each in differences[:MOST_TOLD]]
    if len(differences) > MOST_TOLD:
        lines.append(f"... and {len(differences) - MOST_TOLD} more (--json has all)")
    return "\n".join([*lines, _software(replayed)])


def _software(replayed: "Replayed") -> str:
    if replayed.changed:
        return f"Since the recording: {'; '.join(replayed.changed)}"
    return "The software is that of the recording: the git hash and every version are the same"


def _different(file: Path, replayed: "Replayed") -> str:
    first = one_line(next(each.text for each in replayed.found.differences if not each.rounding))
    return f"{file} did not replay as it was recorded: {first}"


def _content(file: Path, replayed: "Replayed") -> dict[str, Any]:
    different = None if replayed.agrees else error_object(_different(file, replayed), "replay_differs")
    return {
        **({} if different is None else {"error": different}),
        "status": replayed.status,
        "reason": replayed.reason,
        "identical": replayed.identical,
        "agrees": replayed.agrees,
        "breaks_off": replayed.ended,
        "abort_in_place_of": list(replayed.in_place),
        "compared": replayed.found.compared,
        "samples": {"played": replayed.played, "recorded": replayed.rows},
        "differences": [{"text": each.text, "rounding": each.rounding} for each in replayed.found.differences],
        "software_changed": list(replayed.changed),
        "points": [point.model_dump(mode="json") for point in replayed.points],
    }
