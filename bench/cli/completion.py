"""`rockbench completion`: the Tab key of a shell completes commands and options."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from bench.cli.prose import prose
from sim.errors import InvalidInput

Shell = Literal["bash", "zsh", "fish", "powershell"]


def completion_app(root: App) -> App:
    """`rockbench completion`, for the commands of `root`."""

    def completion(
        shell: Annotated[
            Shell | None, Parameter(name="SHELL", help="The shell.", show_default="that which runs this command")
        ] = None,
        /,
        *,
        install: Annotated[
            bool,
            Parameter(
                negative=(),
                show_default=False,
                help="Put the script where the shell looks for it, and a line that loads it into its start-up file.",
            ),
        ] = False,
    ) -> int:
        """Print the script with which a shell completes the commands and options of rockbench, or install it.

        Without --install nothing is written: load the script into the running shell, or keep it where the shell wants
        it. After an update of rockbench, install it again.
        """
        # imported here: no other command needs it
        from cyclopts.completion import ShellDetectionError

        try:
            if install:
                print(f"{root.install_completion(shell=shell)} written; open a new shell")
            else:
                print(root.generate_completion(shell=shell))
        except ShellDetectionError:
            raise InvalidInput("SHELL", "none", "the running shell is not known: name bash, zsh or fish") from None
        except OSError as error:
            where = "its start-up file" if error.filename is None else Path(error.filename)
            raise InvalidInput("--install", str(where), f"it cannot be written: {error.strerror}") from None
        return 0

    app = App(name="completion", help=prose(completion), version_flags=())
    app.default(completion)
    return app
