"""`rockbench replay`: replays a recorded campaign and compares the outcome with its file."""

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.cli.interrupt import report_interrupt
from bench.app.cli.options import CampaignFile, Handed, Json
from bench.app.cli.output import print_error, print_result, print_warning
from bench.app.formatting import one_line
from bench.document.typography import counted
from bench.progress import silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.replay.session import Replayed
    from drivers.clock import Clock

MAX = "max"

MOST_LISTED = 12
"""Maximum number of differences that are listed."""


def replay(
    file: CampaignFile,
    /,
    *,
    speed: Annotated[
        str,
        Parameter(
            metavar="FACTOR", help="Speed: 1 for real time, 10 for ten times as fast, max for as fast as possible."
        ),
    ] = MAX,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Replay a recorded campaign through the same engine, guard, analysis and displays.

    The stored plan is executed on the stored blocks and therefore makes the same decisions; questions get their
    recorded answers, and a recorded request to end is repeated. No device is opened and no other file is read. Every
    drive sample, journal entry and result is compared with the file.

    The exit code is 0 if everything agrees with the recording to within rounding, even if the recording is incomplete;
    1 if there are differences, which are printed; 2 if the file cannot be replayed; 130 after Ctrl-C.
    """
    progress("loading the program")
    from bench.app.catalogue import parameters_of, protocol_of
    from bench.app.cli.terminal import progress_on
    from bench.app.preflight import load_bench
    from bench.app.session import result_of
    from bench.datafile.reader import open_datafile
    from bench.replay.recording import former_keys
    from bench.replay.session import replay as play
    from bench.replay.session import stored_configuration

    clock = _clock(speed)
    with open_datafile(file) as record:
        protocol = protocol_of(record)
        configuration, parameters = stored_configuration(record), parameters_of(record, protocol)
        if notice := former_keys(record):
            print_warning(notice)
        try:
            load_bench(configuration, progress)
            progress("replaying the file")
            with progress_on(sys.stderr, False, protocol) as display, redirect_stdout(sys.stderr):
                prepared = protocol.prepare(parameters, configuration, record.tables)
                replayed = play(record, prepared.plan(), configuration, clock=clock, subscribers=[display])
        except KeyboardInterrupt:
            report_interrupt("the replay was interrupted")
            return 130
        result = result_of(replayed.returned, prepared, replayed.points)
    different = None if replayed.agrees else _different(file, replayed)
    print_result(
        lambda: _content(replayed),
        lambda: _text(replayed, result.text),
        as_json=as_json,
        error=different,
        code="replay_differs",
    )
    if different is not None:
        print_error(different)
        return 1
    return 0


def _clock(speed: str) -> "Clock":
    from drivers.clock import VirtualClock

    if speed == MAX:
        return VirtualClock()
    from bench.config.numbers import read_number
    from bench.replay.session import PacedClock

    allowed = f"it must be a number from 0.01 to 1000, or {MAX}"
    try:
        factor = read_number(speed)
    except ValueError as error:
        raise InvalidInput("--speed", speed, str(error) or allowed) from None
    if not 0.01 <= factor <= 1000.0:
        raise InvalidInput("--speed", speed, allowed)
    return PacedClock(factor)


def _counted(count: int, plural: str) -> str:
    singular = f"{plural[:-3]}y" if plural.endswith("ies") else plural.removesuffix("s")
    return counted(count, singular, plural)


def _text(replayed: "Replayed", table: str) -> str:
    lines = [table.rstrip(), "", f"Replay {replayed.status}: {replayed.reason}"]
    if replayed.ended is not None:
        lines.append(f"The recording is incomplete: {replayed.ended}")
    lines += [
        f"The samples do not reproduce this cause of the end; the replay requested an abort instead: {reason}"
        for reason in replayed.in_place
    ]
    compared = ", ".join(_counted(count, part) for part, count in replayed.found.compared.items() if count)
    if not replayed.same_wording:
        lines.append("The file is from an older version; the wording of its messages was not compared")
    if not replayed.same_intervals:
        lines.append("The file is from an older version; its uncertainties and fits were not compared")
    if replayed.identical:
        there = " up to its last sample" if replayed.ended is not None else ""
        lines.append(f"Bit-identical to the file{there}: {compared}")
        return "\n".join(lines)
    differences = sorted(replayed.found.differences, key=lambda each: each.rounding)
    lines.append(f"Compared with the file: {compared}")
    lines += [("Rounding: " if each.rounding else "Differs: ") + each.text for each in differences[:MOST_LISTED]]
    if len(differences) > MOST_LISTED:
        lines.append(f"... and {len(differences) - MOST_LISTED} more (--json lists all)")
    return "\n".join([*lines, _software(replayed)])


def _software(replayed: "Replayed") -> str:
    if replayed.changed:
        return f"Changed since the recording: {'; '.join(replayed.changed)}"
    return "The software is that of the recording: the git hash and all versions are identical"


def _different(file: Path, replayed: "Replayed") -> str:
    first = one_line(next(each.text for each in replayed.found.differences if not each.rounding))
    return f"{file} did not replay as recorded: {first}"


def _content(replayed: "Replayed") -> dict[str, Any]:
    return {
        "status": replayed.status,
        "reason": replayed.reason,
        "identical": replayed.identical,
        "agrees": replayed.agrees,
        "breaks_off": replayed.ended,
        "abort_in_place_of": list(replayed.in_place),
        "wording_compared": replayed.same_wording,
        "uncertainties_compared": replayed.same_intervals,
        "compared": replayed.found.compared,
        "samples": {"played": replayed.played, "recorded": replayed.rows},
        "differences": [{"text": each.text, "rounding": each.rounding} for each in replayed.found.differences],
        "software_changed": list(replayed.changed),
        "points": [point.model_dump(mode="json") for point in replayed.points],
    }
