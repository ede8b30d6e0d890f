"""`rockbench analyse`: every result of a recorded campaign anew, with other settings, in a file beside the old one."""

import json
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from bench.cli.analyse_output import side_by_side
from bench.cli.analyse_settings import Choice, choice_of, listed, unusual_of
from bench.cli.interrupt import answer
from bench.cli.progress import Handed
from bench.cli.prose import prose
from bench.cli.refusal import fail, warn
from bench.progress import silent
from sim.errors import InvalidInput
from sim.loading import load_model
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.protocol import Prepared, Result
    from bench.record.reader import Record
    from bench.replaying.session import Replayed


def analyse_app() -> App:
    """`rockbench analyse`."""
    app = App(name="analyse", help=prose(analyse), version_flags=())
    app.default(analyse)
    return app


def analyse(
    file: Annotated[Path, Parameter(name="FILE", help="File of a campaign (campaign.h5); it is only read.")],
    /,
    *,
    set_: Annotated[
        tuple[str, ...],
        Parameter(
            name="--set",
            metavar="KEY=VALUE",
            negative=(),
            show_default=False,
            help="A setting to change, any number of times; --list says which there are.",
        ),
    ] = (),
    config: Annotated[
        Path | None,
        Parameter(
            name="--config",
            metavar="FILE",
            help="Configuration (TOML) whose tables analysis, specimen and uncertainty replace the recorded ones.",
        ),
    ] = None,
    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            help="Specimen file (JSON) of what has been identified, in place of what was known at the campaign.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(name="--out", metavar="FILE", help="File to write.", show_default="<name>.analysis-<n>.h5 beside it"),
    ] = None,
    list_: Annotated[
        bool, Parameter(name="--list", negative=(), show_default=False, help="List the settings and stop.")
    ] = False,
    as_json: Annotated[
        bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object, nothing else.")
    ] = False,
    progress: Handed = silent,
) -> int:
    """Compute every result of a recorded campaign anew from its samples, with other settings.

    The new results are written to a file of their own beside the recorded one, with its name, its SHA-256 and the
    settings, and are printed beside the old. A protocol that identifies the specimen leaves `<name>.specimen.json` for
    other runs besides. A setting that would have changed how the table was driven is refused:
    the recorded samples say nothing about that.

    The exit code is 0 when the results were written, 1 when the recorded samples do not answer what was asked, 2 when
    something was refused.
    """
    progress("loading the program")
    from bench.cli.console import progress_on
    from bench.record.reader import open_record
    from bench.replaying.analysis import NotComparable
    from bench.replaying.beside import Analysis, write_analysis

    if out is not None and out.exists():
        raise InvalidInput("--out", str(out), "the file exists and is never overwritten; name another")
    with open_record(file) as record:
        choice = choice_of(record, set_, config, specimen)
        if list_:
            print(listed(choice))
            return 0
        for notice in unusual_of(choice):
            warn(notice)
        try:
            load_model(progress)
            progress("computing the results from the recorded samples")
            with progress_on(sys.stderr, False, choice.protocol) as display, redirect_stdout(sys.stderr):
                result, replayed, points = _carried_out(record, choice, [display])
        except NotComparable as error:
            fail(error)
            return 1
        except KeyboardInterrupt:
            answer("the analysis was interrupted; nothing was written")
            return 130
        kind = choice.protocol.point
        analysis = Analysis(points, kind, choice.given, choice.settings, choice.changed)
        written = write_analysis(file, record, analysis, out)
        kept = _kept(result, written)
        stored = record.points
    new = [point.model_dump(mode="json") for point in points]
    if as_json:
        said = {"file": str(written), "settings": choice.given, "recorded": stored, "points": new}
        print(json.dumps(said | ({} if kept is None else {"kept": str(kept)})))
    else:
        print(side_by_side(kind, stored, new))
        if replayed.ended is not None:
            print(f"The recording breaks off: {replayed.ended}")
        print(f"Written to {written}")
        if kept is not None:
            print(f"For other runs: {kept}")
    return 0


def _kept(result: "Result | None", written: Path) -> Path | None:
    """The file for other runs that an identifying protocol leaves beside its result, such as a specimen file."""
    path: Path | None = None
    if result is None:
        return None
    for name, write in result.files.items():
        path = written.with_name(f"{written.stem}.{name}")
        write(path)
    return path


def _carried_out(
    record: "Record", choice: Choice, subscribers: Sequence[Any]
) -> "tuple[Result | None, Replayed, tuple[Parameters, ...]]":
    """The result of other settings where they are the plan's, the replay, and the points."""
    from bench.replaying.analysis import carry_out, follow
    from bench.session import result_of

    def prepared(parameters: Parameters, configuration: "BenchConfiguration") -> "Prepared[Any]":
        return choice.protocol.prepare(parameters, configuration, record.tables)

    if choice.follower is not None:
        recorded = prepared(choice.asked, choice.recorded)
        return None, *follow(record, recorded, choice.follower, subscribers)
    changed = prepared(choice.settings, choice.changed)
    replayed, points = carry_out(record, changed, choice.recorded, subscribers)
    return result_of(replayed.returned, changed, points), replayed, points
