"""Output of the commands: results as text, JSON, CSV, HDF5 and figure; errors and warnings as lines. The names of the
output files are checked before anything is computed.
"""

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TextIO

from bench.app.formatting import ABSENT, one_line
from bench.figures.text_table import TextColumn, text_table
from bench.inert import shown
from bench.progress import Progress, silent
from sim.errors import InvalidInput, RockbenchError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.app.cli.options import ResultOptions
    from bench.datafile.tables import Table

Code = Literal[
    "usage", "system", "interrupted", "run_failed", "run_aborted", "check_failed", "replay_differs", "damaged_file"
]
"""Codes of errors other than RockbenchError, whose types have their own `error_code`."""

_objects: TextIO | None = None
"""Stream for the JSON object of an error; None for a command without --json."""


def reply_in_json(stream: TextIO | None) -> None:
    """Set the stream on which `report_error` prints its object; with None, it prints no object."""
    global _objects
    _objects = stream


def print_result(
    content: Callable[[], Mapping[str, Any]],
    text: Callable[[], str],
    *,
    as_json: bool,
    error: BaseException | str | None = None,
    code: Code | None = None,
) -> None:
    """Print the result of a command on standard output: its text, or one JSON object in which a number that is not
    finite is null.

    An `error` with which the command ended is printed only in the object, under the key "error".
    """
    if not as_json:
        print(shown(text()))
        return
    from bench.figures.summary import json_ready

    ended = {} if error is None else {"error": error_object(error, code)}
    print(json.dumps(json_ready({**content(), **ended}), allow_nan=False))


def print_warning(message: object) -> None:
    """Print a warning as one line on standard error; the command continues."""
    print(f"rockbench: warning: {one_line(str(message))}", file=sys.stderr)


def print_error(message: object) -> None:
    """Print an error as one line on standard error; line breaks and control characters are removed."""
    print(f"rockbench: error: {one_line(str(message))}", file=sys.stderr)


def report_error(error: BaseException | str, code: Code | None = None) -> None:
    """Report the error of a command that ended without a result: a line on standard error and, with --json, one object
    with the key "error" on standard output.
    """
    global _objects
    print_error(error)
    stream, _objects = _objects, None
    if stream is not None:
        print(json.dumps({"error": error_object(error, code)}), file=stream, flush=True)


def error_object(error: BaseException | str, code: Code | None = None) -> dict[str, Any]:
    """An error as a JSON object: `code`, `message`, and `item`, `value`, `remedy` where they are known. The code is
    that of the error type; the argument `code` applies to errors other than RockbenchError.
    """
    known = isinstance(error, InvalidInput)
    return {
        "code": error.error_code if isinstance(error, RockbenchError) else code or "system",
        "message": one_line(str(error)),
        "item": error.item if known else None,
        "value": one_line(str(error.value)) if known else None,
        "remedy": error.allowed if known else None,
    }


FIGURES = (".png", ".pdf", ".svg")


@dataclass(frozen=True, eq=False)
class Result:
    """A result in every form of output; each form is created only when requested.

    CSV contains the first of the `tables`, JSON `content` and `metadata`. `write`, if given, writes the file of --out
    instead of the usual HDF5 file; `close` is called when all files have been written.
    """

    title: str
    content: Callable[[], Mapping[str, Any]]
    text: Callable[[], str]
    figure: "Callable[[], Figure]"
    metadata: Mapping[str, Any]
    tables: "Mapping[str, Table]"
    write: Callable[[Path], None] | None = None
    close: Callable[[], None] = lambda: None


def check_files(options: "ResultOptions") -> None:
    """Check the output files without creating them.

    Raises InvalidInput, naming the option, if a file exists, cannot be created, has an unknown extension or is named
    twice.
    """
    import tempfile

    named = {"--csv": options.csv, "--out": options.out, "--plot": options.plot}
    wanted = {item: path for item, path in named.items() if path is not None}
    if options.plot is not None and options.plot.suffix.lower() not in FIGURES:
        raise InvalidInput("--plot", str(options.plot), f"its name must end with {', '.join(FIGURES)}")
    seen: dict[Path, str] = {}
    for item, path in wanted.items():
        if path.exists():
            raise InvalidInput(item, str(path), "the file exists and is never overwritten; choose another name")
        if not path.parent.is_dir():
            raise InvalidInput(item, str(path), "the folder does not exist; create it first")
        other = seen.setdefault(path.resolve(), item)
        if other != item:
            raise InvalidInput(item, str(path), f"{other} would write the same file; choose another name")
        try:
            # try to create a file, because permission bits are not reliable on every file system
            with tempfile.TemporaryFile(dir=path.parent):
                pass
        except OSError as error:
            raise InvalidInput(item, str(path), f"{path.parent} cannot be written: {error.strerror}") from None


def deliver(make: Callable[[], Result], options: "ResultOptions", progress: Progress = silent) -> int:
    """Compute a result, write the requested files, then print.

    Returns 0, or 1 with a line on standard error if the computation or the disk fails or there is nothing to draw; in
    the last case, no file is written. Raises InvalidInput.
    """
    try:
        result = make()
        _write(result, options, progress)
        close = result.close
        # a file whose values are still referenced cannot be removed on Windows
        del result
        close()
    except InvalidInput:
        raise
    except (RockbenchError, OSError) as error:
        report_error(error)
        return 1
    return 0


def _write(result: Result, options: "ResultOptions", progress: Progress) -> None:
    from bench.prediction.files import write_csv, write_hdf5

    if options.plot is not None:
        progress("drawing the figure")
    figure = result.figure() if options.plot is not None else None
    if options.csv is not None:
        write_csv(options.csv, next(iter(result.tables.values())))
    if options.out is not None:
        if result.write is not None:
            result.write(options.out)
        else:
            write_hdf5(options.out, result.title, result.tables, result.metadata)
    if options.plot is not None and figure is not None:
        from bench.figures.style import write_figure

        write_figure(options.plot, figure)
    print_result(lambda: {**result.content(), **result.metadata}, result.text, as_json=options.json)


def columns_text(table: "Table", headings: Mapping[str, str]) -> str:
    """Text table of the columns named by the keys of `headings`, each under its heading."""
    columns = [
        TextColumn(heading, "" if (unit := table[name].unit) == "1" else unit) for name, heading in headings.items()
    ]
    cells = (map(cell, table[name].values.tolist()) for name in headings)
    return text_table(columns, zip(*cells, strict=True))


def cell(value: Any) -> str:
    """A value of a table as text; numbers have five significant digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return ABSENT if value != value else f"{value:.5g}"
    return str(value)
