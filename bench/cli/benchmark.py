"""`rockbench benchmark`: run time against error, and the cost of everything, measured on this machine."""

from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.output import check_folder, default_folder, make_folder, remove_unused
from bench.cli.progress import Handed
from bench.progress import silent


def benchmark_app() -> App:
    """`rockbench benchmark`, a command of its own."""
    app = App(name="benchmark", help="Measure speed and error of the engine beside its peers.", version_flags=())
    app.default(benchmark)
    return app


def benchmark(
    *,
    quick: Annotated[
        bool, Parameter(negative=(), show_default=False, help="Measure less, in about a minute; maps are coarser.")
    ] = False,
    out: Annotated[
        Path | None,
        Parameter(
            metavar="DIR",
            help="Folder for the results; made if missing. Results that are there already are never overwritten.",
            show_default="runs/benchmark-<local date and time>",
        ),
    ] = None,
    progress: Handed = silent,
) -> int:
    """Measure speed and error of the engine beside its peers.

    Prints tables and writes them as benchmark.md and benchmark.json, with machine and versions, and a figure,
    work_precision.png. Peers that are not installed are named as such: uv sync --group benchmark installs them.
    The exit code is 0 whatever the numbers are, and 2 when something was refused.
    """
    progress("loading the program")
    from bench.benchmark.suite import FULL, QUICK, RESULTS, run_benchmark

    folder = out or default_folder("benchmark", datetime.now())
    check_folder(folder, RESULTS)
    if out is None:
        folder = make_folder(folder)
    try:
        run_benchmark(QUICK if quick else FULL, folder, progress=progress)
    finally:
        if out is None:
            remove_unused(folder)
    print(f"Results are in {folder}")
    return 0
