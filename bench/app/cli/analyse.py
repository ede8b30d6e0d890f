"""`rockbench analyse`: recomputes the results of a recorded campaign with other settings, and writes them to a new
file.
"""

import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.cli.analyse_settings import Choice, choice_of, listed, settings_of, unusual_of
from bench.app.cli.interrupt import report_interrupt
from bench.app.cli.options import CampaignFile, Handed, Json
from bench.app.cli.output import print_result, print_warning, report_error
from bench.app.formatting import ABSENT
from bench.figures.text_table import TextColumn, text_table
from bench.progress import silent
from sim.errors import InvalidInput
from sim.loading import load_model
from sim.parameters import Parameters, unit_of

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.datafile.reader import DataFile
    from bench.protocol import Prepared, Result
    from bench.replay.session import Replayed

HEADLINES = ("status", "alpha_2", "alpha_2_uncertainty", "alpha_2_predicted", "agrees")
"""Main results of a point, which are printed if the protocol has them; the file contains all fields."""

WIDEST = 44
"""Maximum length of a printed value or label [characters]."""


def analyse(
    file: CampaignFile,
    /,
    *,
    set_: Annotated[
        tuple[str, ...],
        Parameter(
            name="--set",
            metavar="KEY=VALUE",
            negative=(),
            show_default=False,
            help="Setting to change; may be given several times. --list shows all settings.",
        ),
    ] = (),
    config: Annotated[
        Path | None,
        Parameter(
            name="--config",
            metavar="FILE",
            help="Configuration (TOML) whose tables analysis, specimen and uncertainty, and whose specimen_file if it "
            "has one, replace the recorded ones.",
        ),
    ] = None,
    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            help="Specimen file (JSON) of identified properties, used instead of those of the campaign.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="FILE",
            help="File to write.",
            show_default="<name>.analysis-<n>.h5 in the same folder",
        ),
    ] = None,
    list_: Annotated[
        bool, Parameter(name="--list", negative=(), show_default=False, help="List the settings and exit.")
    ] = False,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Recompute every result of a recorded campaign from its samples, with other settings.

    The new results are printed next to the old ones and written to a separate file, together with the settings and the
    name and SHA-256 of the recorded file. A protocol that identifies the specimen also writes
    `<name>.specimen.json` for other runs. Settings that would have changed the drive of the table are refused: the
    recorded samples cannot show their effect.

    The exit code is 0 when the results were written, 1 when this version of the software does not reproduce the
    recorded results, 2 when an input was refused.
    """
    progress("loading the program")
    from bench.app.cli.terminal import progress_on
    from bench.datafile.reader import open_datafile
    from bench.replay.analysis import Analysis, DriveChanged, NotComparable, write_analysis
    from bench.replay.recording import former_keys

    if out is not None and out.exists():
        raise InvalidInput("--out", str(out), "the file exists and is never overwritten; choose another name")
    with open_datafile(file) as record:
        choice = choice_of(record, set_, config, specimen)
        if list_:
            print_result(lambda: {"settings": settings_of(choice)}, lambda: listed(choice), as_json=as_json)
            return 0
        if out is not None:
            _check_companions(choice, out)
        former = former_keys(record)
        for notice in (*([former] if former else ()), *unusual_of(choice)):
            print_warning(notice)
        try:
            load_model(progress)
            progress("computing the results from the recorded samples")
            with progress_on(sys.stderr, False, choice.protocol) as display, redirect_stdout(sys.stderr):
                result, replayed, points = _carried_out(record, choice, [display])
        except NotComparable as error:
            report_error(error)
            return 2 if isinstance(error, DriveChanged) else 1
        except KeyboardInterrupt:
            report_interrupt("the analysis was interrupted; nothing was written")
            return 130
        kind = choice.protocol.point
        analysis = Analysis(points, kind, choice.given, choice.settings, choice.changed)
        names = () if result is None else tuple(result.files)
        written = write_analysis(file, record, analysis, out, companions=lambda path: [_beside(path, n) for n in names])
        kept = _kept(result, written)
        stored = record.points
    new = [point.model_dump(mode="json") for point in points]
    content = {"file": str(written), "settings": choice.given, "recorded": stored, "points": new}
    further = [] if replayed.ended is None else [f"The recording is incomplete: {replayed.ended}"]
    if len(new) < len(stored):
        further.append(f"{len(new)} of {len(stored)} recorded results could be computed again")
    further.append(f"Written to {written}")
    if kept is not None:
        content["kept"] = str(kept)
        further.append(f"For other runs: {kept}")
    print_result(lambda: content, lambda: "\n".join([side_by_side(kind, stored, new), *further]), as_json=as_json)
    return 0


def _kept(result: "Result | None", written: Path) -> Path | None:
    """Write the result files that other runs use, such as a specimen file; returns the path of the last one, or
    None.
    """
    path: Path | None = None
    if result is None:
        return None
    for name, write in result.files.items():
        path = _beside(written, name)
        write(path)
    return path


def _beside(written: Path, name: str) -> Path:
    """Path of a result file that other runs use, for the analysis file `written`."""
    return written.with_name(f"{written.stem}.{name}")


def _check_companions(choice: Choice, out: Path) -> None:
    """Raise InvalidInput if a file that is written together with `out` exists."""
    if choice.follower is None:
        for path in (_beside(out, name) for name in choice.protocol.files):
            if path.exists():
                allowed = f"{path} exists, would be written too, and is never overwritten; choose another name"
                raise InvalidInput("--out", str(out), allowed)


def _carried_out(
    record: "DataFile", choice: Choice, subscribers: Sequence[Any]
) -> "tuple[Result | None, Replayed, tuple[Parameters, ...]]":
    """The result (None for a protocol that defines a re-analysis), the replay, and the recomputed points."""
    from bench.app.session import result_of
    from bench.replay.analysis import carry_out, follow

    def prepared(parameters: Parameters, configuration: "BenchConfiguration") -> "Prepared[Any]":
        return choice.protocol.prepare(parameters, configuration, record.tables)

    if choice.follower is not None:
        recorded = prepared(choice.asked, choice.recorded)
        return None, *follow(record, recorded, choice.follower, subscribers)
    changed = prepared(choice.settings, choice.changed)
    replayed, points = carry_out(record, changed, choice.recorded, subscribers)
    return result_of(replayed.returned, changed, points), replayed, points


def side_by_side(kind: type[Parameters], stored: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]]) -> str:
    """Table of recorded and new values: the main results, or every changed field if a protocol has no main results."""
    fields = kind.model_fields
    labels = list(fields)[:2]
    shown = [name for name in HEADLINES if name in fields]
    rows: list[list[str]] = []
    # the samples of the last results of a recovered file may be lost
    for before, after in zip(stored, new, strict=False):
        label = ", ".join(_shown(after[name]) for name in labels)
        names = shown or [name for name in fields if before.get(name) != after[name]]
        for name in names:
            was, now = before.get(name), after[name]
            rows.append([label, name, unit_of(fields[name]), _shown(was), _shown(now), _change(was, now)])
    if not rows:
        return "No result changed."
    columns = (
        TextColumn(", ".join(labels), words=True),
        TextColumn("result", words=True),
        TextColumn("unit", words=True),
        TextColumn("recorded"),
        TextColumn("new"),
        TextColumn("change", "%"),
    )
    return text_table(columns, rows)


def _shown(value: Any) -> str:
    if value is None or value != value:
        return ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…"


def _change(was: Any, now: Any) -> str:
    if isinstance(was, float) and isinstance(now, float) and was:
        return f"{100.0 * (now / was - 1.0):+.3f}"
    return "" if was == now else "changed"
