"""Standard error that tolerates the loss of its reader, so that a run continues without a display."""

import os
import sys
from contextlib import suppress
from typing import Any, TextIO, cast


class _Lasting:
    """A stream that ignores write errors: a closed pipe or terminal, or a full disk.

    After the first error, nothing more is written to the stream, and its buffer is sent to the null device; otherwise
    the interpreter would report the same error at exit.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._gone = stream, False

    def write(self, text: str) -> int:
        if not self._gone:
            try:
                self._stream.write(text)
            except (OSError, ValueError):
                self._let_go()
        return len(text)

    def flush(self) -> None:
        if not self._gone:
            try:
                self._stream.flush()
            except (OSError, ValueError):
                self._let_go()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _let_go(self) -> None:
        self._gone = True
        if self._stream is not sys.__stderr__:
            return
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)
            self._stream.flush()


def lasting(stream: TextIO) -> TextIO:
    """`stream` wrapped so that its write errors are ignored."""
    return stream if isinstance(stream, _Lasting) else cast(TextIO, _Lasting(stream))
