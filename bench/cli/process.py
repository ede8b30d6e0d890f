"""The process of the command `rockbench`: its signals, its streams and its exit code."""

import os
import signal
import sys
from types import FrameType


def run() -> None:
    """Entry point of the console script."""
    # everything else is imported when a signal can be answered: it takes a third of a second
    signal.signal(signal.SIGINT, _at_once)
    from bench.cli.interrupt import Interrupts, answer, heed_signals, leave

    interrupts = Interrupts()
    try:
        heed_signals(interrupts)
        code = _carry_out()
    except KeyboardInterrupt:
        answer("interrupted")
        code = 130
    except BaseException:
        if interrupts.first is None:
            raise
        # an interrupt that some library turned into an error of its own
        answer("interrupted")
        code = 130
    if interrupts.exit_code is not None or code == 130:
        # an ordinary exit would wait for threads that still compute
        leave(interrupts.exit_code or code if code == 130 else code)
    sys.exit(code)


def _at_once(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
    os.write(2, b"rockbench: error: interrupted\n")
    os._exit(130)


def _carry_out() -> int:
    from io import TextIOWrapper

    from bench.cli.main import main
    from bench.cli.progress import phases_on

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            # a console that cannot show a character shows another, and the run goes on
            stream.reconfigure(errors="replace")
    try:
        with phases_on(sys.stderr) as progress:
            code = main(progress=progress)
        sys.stdout.flush()
    except BrokenPipeError:
        # the reader, such as `head`, has seen enough; what is still held back has nowhere to go at exit either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    return code
