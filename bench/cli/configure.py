"""`rockbench config`: writes and checks configuration files of the bench."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.refusal import tell, warn
from sim.errors import InvalidInput


def config_app() -> App:
    """`rockbench config`, with `init` and `check`."""
    app = App(name="config", help="Write or check a configuration file of the bench.", version_flags=())
    app.command(init)
    app.command(check)
    return app


def init(
    file: Annotated[Path, Parameter(help="File to write.", metavar="FILE", negative=())] = Path("rockbench.toml"),
    /,
    *,
    minimal: Annotated[
        bool, Parameter(negative=(), show_default=False, help="Only what to look at before the first run.")
    ] = False,
    hardware: Annotated[
        bool,
        Parameter(negative=(), show_default=False, help="A complete example of a bench with NI and optoNCDT devices."),
    ] = False,
) -> int:
    """Write a configuration file with every key, its default, unit and limits.

    A file that exists is never overwritten.
    """
    from bench.config.template import write_template

    if minimal and hardware:
        raise InvalidInput("--minimal", "--hardware", "give one of them")
    write_template(file, "minimal" if minimal else "hardware" if hardware else "all")
    what = (
        "what to look at first" if minimal else "an example with devices" if hardware else "every key with its default"
    )
    print(f"{file} written: {what}")
    return 0


def check(file: Annotated[Path, Parameter(help="File to check.", metavar="FILE", negative=())], /) -> int:
    """Check a configuration file and say all that is wrong with it, one line for each key.

    Values that are valid but unusual are warned of. The exit code is 0 when the file is good and 2 when it is not.
    """
    from bench.config.review import review
    from bench.config.toml import problems_of, read_configuration

    problems = problems_of(file)
    for problem in problems:
        tell(problem)
    if problems:
        return 2
    for notice in review(read_configuration(file)).notices:
        warn(notice)
    print(f"{file} is good")
    return 0
