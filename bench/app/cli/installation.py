"""Commands for the installation: configuration files, benchmark and shell completion."""

from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from bench.app.cli.options import Handed, switch
from bench.app.cli.output import print_error, print_warning
from bench.app.folders import check_folder, default_folder, make_folder, remove_unused
from bench.progress import silent
from sim.errors import InvalidInput

Shell = Literal["bash", "zsh", "fish", "powershell"]


def init(
    file: Annotated[Path, Parameter(help="File to write.", metavar="FILE", negative=())] = Path("rockbench.toml"),
    /,
    *,
    minimal: Annotated[bool, switch("Write only the keys to check before the first run.")] = False,
    hardware: Annotated[
        bool,
        switch("Write a complete example of a bench with NI and optoNCDT devices."),
    ] = False,
    backend: Annotated[
        str | None,
        Parameter(
            metavar="NAME", help="Write the configuration of a rig backend of another package.", show_default=False
        ),
    ] = None,
) -> int:
    """Write a configuration file with every key, its default, unit and limits.

    An existing file is never overwritten.
    """
    from bench.config.template import write_template

    if minimal and hardware:
        raise InvalidInput("--minimal", "--hardware", "the two options exclude each other; use only one of them")
    if backend is not None and (minimal or hardware):
        raise InvalidInput(
            "--backend",
            backend,
            f"it cannot be combined with {'--minimal' if minimal else '--hardware'}; use only one of them",
        )
    write_template(file, "minimal" if minimal else "hardware" if hardware else "all", backend)
    what = (
        "the keys to check first"
        if minimal
        else "an example with devices"
        if hardware
        else "every key of the rig backend"
    )
    if not (minimal or hardware or backend):
        what = "every key with its default"
    print(f"{file} written: {what}")
    return 0


def check(file: Annotated[Path, Parameter(help="File to check.", metavar="FILE", negative=())], /) -> int:
    """Check a configuration file and list every error, one line for each key.

    Valid but unusual values get a warning. The exit code is 0 if the file is valid and 2 if it is not.
    """
    from bench.config.review import review
    from bench.config.toml import former_keys, problems_of, read_configuration

    problems = problems_of(file)
    for problem in problems:
        print_error(problem)
    if problems:
        return 2
    for notice in (*former_keys(file), *review(read_configuration(file)).notices):
        print_warning(notice)
    print(f"{file} is valid")
    return 0


def benchmark(
    *,
    quick: Annotated[bool, switch("Shorter benchmark of about a minute, with coarser maps.")] = False,
    out: Annotated[
        Path | None,
        Parameter(
            metavar="DIR",
            help="Folder for the results, created if missing. Existing results are never overwritten.",
            show_default="runs/benchmark-<local date and time>",
        ),
    ] = None,
    progress: Handed = silent,
) -> int:
    """Measure speed and error of the engine and of comparable integrators.

    Prints tables and writes benchmark.md and benchmark.json, with machine and versions, and the figure
    work_precision.png. Integrators that are not installed are marked; `uv sync --inexact --group benchmark` installs
    them. The exit code does not depend on the numbers: it is 0, or 2 if an input was refused or a timed command failed.
    """
    progress("loading the program")
    from bench.app.benchmark.suite import FULL, QUICK, RESULTS, run_benchmark

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


def completion(
    shell: Annotated[
        Shell | None, Parameter(name="SHELL", help="The shell.", show_default="the shell that runs this command")
    ] = None,
    /,
    *,
    install: Annotated[
        bool,
        switch("Install the script, and add a line that loads it to the shell's start-up file."),
    ] = False,
) -> int:
    """Print or install the shell completion script for the commands and options of rockbench.

    Without --install nothing is written: load the printed script into the running shell, or save it in the shell's
    completion folder. Install it again after an update of rockbench.
    """
    from cyclopts.completion import ShellDetectionError

    from bench.app.cli.main import rockbench_app

    root = rockbench_app()

    try:
        printed = (
            f"{root.install_completion(shell=shell)} written; open a new shell"
            if install
            else root.generate_completion(shell=shell)
        )
    except ShellDetectionError:
        raise InvalidInput(
            "SHELL", "none", "the running shell was not recognised; specify bash, zsh, fish or powershell"
        ) from None
    except OSError as error:
        where = "its start-up file" if error.filename is None else Path(error.filename)
        raise InvalidInput("--install", str(where), f"the file cannot be written: {error.strerror}") from None
    print(printed)
    return 0
