"""A separate process that reads files for the window.

HDF5 is called with the lock of the Python interpreter held: as long as it waits for a disk, no other thread of the
process continues, and a process cannot end in an orderly way. A window that read a file from a network share that
stalls could neither keep the connection to its session nor react to STOP.
"""

import atexit
import os
import pickle
import struct
import subprocess
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from threading import Lock
from typing import IO, cast

from drivers.child import OWN_CONSOLE
from sim.errors import RockbenchError

_LENGTH = struct.Struct("<Q")
"""Header of a message: its length."""
_ENDING = 0.2
"""Longest wait for the killed process [s]: one that the disk blocks ends later, by itself."""


class ReadingProcess:
    """The process, started by the first call at the latest; one that has ended is replaced."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._process: subprocess.Popen[bytes] | None = None
        atexit.register(self.end)

    def call(self, function: Callable[[], object]) -> object:
        """The value of `function` called in the process; function and value are pickled. Other threads wait meanwhile.

        Raises RockbenchError with the message of the function's RockbenchError, the function's OSError, and
        RuntimeError with the message and, as a note, the traceback of any other exception.
        """
        with self._lock:
            process = self._process = self._process or _started()
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                # the folder to which relative paths refer
                _send(process.stdin, pickle.dumps((os.getcwd(), function)))
                kind, answer = cast("tuple[str, object]", pickle.loads(_receive(process.stdout)))
            except EOFError:
                self._discard()
                message = "the process that reads files has ended: check the file with `rockbench file verify`"
                raise RockbenchError(message) from None
        if kind == "value":
            return answer
        raise cast(Exception, answer)

    def start(self) -> None:
        """Start the process before the first call, which would wait a second for its imports; returns at once."""
        if self._lock.acquire(blocking=False):
            self._process = self._process or _started()
            self._lock.release()

    def end(self) -> None:
        """End the process, also during a call."""
        if (process := self._process) is not None:
            process.kill()
            # once the interrupted call has returned
            if self._lock.acquire(timeout=_ENDING):
                self._discard()
                self._lock.release()

    def _discard(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    stream.close()
            with suppress(subprocess.TimeoutExpired):
                process.wait(_ENDING)


def _started() -> subprocess.Popen[bytes]:
    # unbuffered: at exit, Python aborts if a thread still holds the lock of a buffer in which it waits
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "bench.app.reading_process"],
        bufsize=0,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        creationflags=OWN_CONSOLE,
        start_new_session=sys.platform != "win32",
    )


def _send(to: IO[bytes], message: bytes) -> None:
    left = memoryview(_LENGTH.pack(len(message)) + message)
    try:
        while left:
            left = left[to.write(left) :]
    except OSError as error:
        raise EOFError from error


def _receive(source: IO[bytes]) -> bytes:
    """The next message. Raises EOFError if the other process has ended."""
    (length,) = _LENGTH.unpack(_exactly(source, _LENGTH.size))
    return _exactly(source, length)


def _exactly(source: IO[bytes], length: int) -> bytes:
    parts, left = list[bytes](), length
    while left:
        part = source.read(min(left, 2**24))
        if not part:
            raise EOFError
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def _answer(request: bytes) -> bytes:
    try:
        folder, function = cast("tuple[str, Callable[[], object]]", pickle.loads(request))
        os.chdir(folder)
        return pickle.dumps(("value", function()))
    except RockbenchError as error:
        return pickle.dumps(("error", RockbenchError(str(error))))
    except OSError as error:
        return pickle.dumps(("error", error))
    except Exception as error:
        mistake = RuntimeError(f"{type(error).__name__}: {error}")
        mistake.add_note(traceback.format_exc())
        return pickle.dumps(("error", mistake))


def main() -> None:
    """Answer calls until the standard input is closed; a run has precedence on the processors."""
    if sys.platform != "win32":
        os.nice(10)
    # what most calls need
    import_module("bench.app.display.run_file")
    # whatever a library prints must not be taken for an answer
    calls, answers = (os.fdopen(os.dup(number), mode, 0) for number, mode in ((0, "rb"), (1, "wb")))
    os.dup2(2, 1)
    with suppress(EOFError):
        while True:
            _send(answers, _answer(_receive(calls)))


if __name__ == "__main__":
    main()
