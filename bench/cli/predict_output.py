"""Where a prediction goes: standard output, CSV, HDF5, a figure. Checked before anything is computed."""

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.predict_options import ResultOptions
from bench.cli.refusal import fail
from bench.progress import Progress, silent
from sim.errors import InvalidInput, RockbenchError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.record.tables import Table

FIGURES = (".png", ".pdf", ".svg")


@dataclass(frozen=True, eq=False)
class Result:
    """A prediction, ready for every form of output.

    `tables`: the first is the one that CSV gets. `content`: what JSON says. `figure` is called when one is asked for.
    """

    title: str
    tables: Mapping[str, "Table"]
    content: Mapping[str, Any]
    text: str
    metadata: Mapping[str, Any]
    figure: Callable[[], "Figure"]


def check_files(options: ResultOptions) -> None:
    """Refuse files that exist, cannot be made, have no meaning, or are one and the same. Leaves nothing behind.

    Raises InvalidInput naming the option.
    """
    named = {"--csv": options.csv, "--out": options.out, "--plot": options.plot}
    wanted = {item: path for item, path in named.items() if path is not None}
    if options.plot is not None and options.plot.suffix.lower() not in FIGURES:
        raise InvalidInput("--plot", str(options.plot), f"its name must end with {', '.join(FIGURES)}")
    seen: dict[Path, str] = {}
    for item, path in wanted.items():
        if path.exists():
            raise InvalidInput(item, str(path), "it exists and is never overwritten; name another")
        if not path.parent.is_dir():
            raise InvalidInput(item, str(path), "its folder does not exist; create it first")
        other = seen.setdefault(path.resolve(), item)
        if other != item:
            raise InvalidInput(item, str(path), f"{other} goes there already; name another")
        try:
            # permission bits do not tell the truth on every file system: try it
            with tempfile.TemporaryFile(dir=path.parent):
                pass
        except OSError as error:
            raise InvalidInput(item, str(path), f"{path.parent} cannot be written: {error.strerror}") from None


def carried_out(make: Callable[[], Result], options: ResultOptions, progress: Progress = silent) -> int:
    """Compute a prediction and deliver it. Returns 0, or 1 with a line on standard error. Raises InvalidInput."""
    try:
        deliver(make(), options, progress)
    except InvalidInput:
        raise
    except (RockbenchError, OSError) as error:
        fail(error)
        return 1
    return 0


def deliver(result: Result, options: ResultOptions, progress: Progress = silent) -> None:
    """Write the files that are asked for, then print.

    Raises RockbenchError when there is nothing to draw, before anything is written, or when the disk fails.
    """
    from bench.prediction.files import write_csv, write_hdf5

    if options.plot is not None:
        progress("drawing the figure")
    figure = result.figure() if options.plot is not None else None
    if options.csv is not None:
        write_csv(options.csv, next(iter(result.tables.values())))
    if options.out is not None:
        write_hdf5(options.out, result.title, result.tables, result.metadata)
    if options.plot is not None and figure is not None:
        from bench.report.style import write_figure

        write_figure(options.plot, figure)
    if options.json:
        print(json.dumps({**result.content, **result.metadata}, allow_nan=False))
    else:
        print(result.text)
