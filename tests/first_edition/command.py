"""The command `rockbench` and the data of its first edition, reached as a user reaches them: no module is imported."""

import signal
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib.metadata import entry_points
from io import StringIO
from pathlib import Path

import pytest

DATA = Path(__file__).parents[1] / "data" / "first_edition"


@dataclass(frozen=True)
class Done:
    """How a command ended: its exit code and what it wrote."""

    code: int
    out: str
    err: str


Rockbench = Callable[..., Done]


def command(*arguments: object) -> Done:
    """Carry out a command line of the installed `rockbench` in this process."""
    (script,) = entry_points(group="console_scripts", name="rockbench")
    out, err, before = StringIO(), StringIO(), sys.argv
    # what a process of its own would take to its end
    hook, handlers = sys.unraisablehook, {number: signal.getsignal(number) for number in signal.valid_signals()}
    sys.argv = ["rockbench", *map(str, arguments)]
    try:
        with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended:
            script.load()()
    finally:
        sys.argv, sys.unraisablehook = before, hook
        signal.set_wakeup_fd(-1)
        # an interrupt is answered once in the life of a process, which goes on here
        sys.modules["bench.app.cli.interrupt"].__dict__["_watch"] = None
        for number, handler in handlers.items():
            if handler is not signal.getsignal(number):
                signal.signal(number, handler)
    return Done(int(ended.value.code or 0), out.getvalue(), err.getvalue())
