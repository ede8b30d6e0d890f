"""`rockbench config`: writes and checks configuration files of the bench."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.refusal import tell


def config_app() -> App:
    """`rockbench config`, with `init` and `check`."""
    app = App(name="config", help="Write or check a configuration file of the bench.", version_flags=())
    app.command(init)
    app.command(check)
    return app


def init(
    file: Annotated[Path, Parameter(help="File to write.", metavar="FILE", negative=())] = Path("rockbench.toml"),
    /,
) -> int:
    """Write a configuration file with every key, its default, unit and limits.

    A file that exists is never overwritten.
    """
    from bench.config.toml import write_commented

    write_commented(file)
    print(f"{file} written: every key with its default")
    return 0


def check(file: Annotated[Path, Parameter(help="File to check.", metavar="FILE", negative=())], /) -> int:
    """Check a configuration file and say all that is wrong with it, one line for each key.

    The exit code is 0 when the file is good and 2 when it is not.
    """
    from bench.config.toml import problems_of

    problems = problems_of(file)
    for problem in problems:
        tell(problem)
    if problems:
        return 2
    print(f"{file} is good")
    return 0
