"""`rockbench analyse`: every result of a recorded campaign anew, with other settings, in a file beside the old one."""

import json
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter

from bench.cli.analyse_output import side_by_side
from bench.cli.analyse_settings import Choice, choice_of, listed
from bench.cli.refusal import tell
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.record.reader import Record
    from bench.replaying.session import Replayed


def analyse_app() -> App:
    """`rockbench analyse`."""
    app = App(name="analyse", version_flags=())
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
) -> int:
    """Compute every result of a recorded campaign anew from its samples, with other settings.

    The new results are written to a file of their own beside the recorded one, with its name, its SHA-256 and the
    settings, and are printed beside the old. A setting that would have changed how the table was driven is refused:
    the recorded samples say nothing about that.

    The exit code is 0 when the results were written, 1 when the recorded samples do not answer what was asked, 2 when
    something was refused.
    """
    from bench.record.reader import open_record
    from bench.replaying.analysis import NotComparable
    from bench.replaying.beside import Analysis, write_analysis

    if out is not None and out.exists():
        raise InvalidInput("--out", str(out), "the file exists and is never overwritten; name another")
    with open_record(file) as record:
        choice = choice_of(record, set_, config)
        if list_:
            print(listed(choice))
            return 0
        try:
            with choice.entry.progress(sys.stderr, False) as progress, redirect_stdout(sys.stderr):
                replayed, points = _points(record, choice, [progress])
        except NotComparable as error:
            tell(error)
            return 1
        except KeyboardInterrupt:
            tell("the analysis was interrupted; nothing was written")
            return 130
        kind = choice.entry.campaign(choice.asked).point_type
        analysis = Analysis(points, kind, choice.given, choice.settings, choice.changed)
        written = write_analysis(file, record, analysis, out)
        stored = record.points
    new = [point.model_dump(mode="json") for point in points]
    if as_json:
        print(json.dumps({"file": str(written), "settings": choice.given, "recorded": stored, "points": new}))
    else:
        print(side_by_side(kind, stored, new))
        if replayed.ended is not None:
            print(f"The recording breaks off: {replayed.ended}")
        print(f"Written to {written}")
    return 0


def _points(record: "Record", choice: Choice, subscribers: Sequence[Any]) -> "tuple[Replayed, tuple[Parameters, ...]]":
    from bench.replaying.analysis import carry_out, follow

    if choice.follower is None:
        experiment = choice.entry.campaign(choice.settings)
        return carry_out(record, experiment, choice.recorded, choice.changed, subscribers)
    experiment = choice.entry.campaign(choice.asked)
    return follow(record, experiment, choice.recorded, choice.follower, subscribers)
