"""The far end of a serial line: plays a script of commands and answers on a pseudo terminal."""

import os
import select
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Self

import pytest

from tests.drivers.optoncdt.script import STARTED, STOPPED, Script

if os.name == "nt":
    pytest.skip("needs pseudo terminals", allow_module_level=True)

import fcntl
import termios
import tty

from tests.patience import LONG


class Peer:
    """Expects the commands of `script` in this order, each ended by a line feed, and answers; then says nothing.

    Commands that do not come, and others that do, fail the test at the end. With `baud` it understands nothing at
    other baud rates, and answers with `noise`.
    """

    def __init__(self, script: Script, *, baud: int | None = None, noise: bytes = b"", tidy: bool = True) -> None:
        self._script = [*script, *(STOPPED if tidy and script and script[-1] in STARTED else [])]
        self._baud, self._noise = baud, noise
        self._heard = 0
        self._wrong: list[str] = []
        self._changed = threading.Condition()
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self._slave = slave
        self._over_read, self._over_write = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Say something unasked."""
        while data:
            data = data[os.write(self._master, data) :]

    @property
    def unread(self) -> int:
        """How many bytes wait at the client's end."""
        return int.from_bytes(fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)), sys.byteorder)

    def wait_heard(self, commands: int) -> None:
        """Wait until so many commands have come."""
        with self._changed:
            assert self._changed.wait_for(lambda: self._heard >= commands or self._wrong, LONG)

    def unplug(self) -> None:
        """Both ends of the line go."""
        os.write(self._over_write, b"x")
        self._thread.join()
        if self._slave >= 0:
            os.close(self._master)
            os.close(self._slave)
            self._slave = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        self.unplug()
        os.close(self._over_read)
        os.close(self._over_write)
        if kind is None:
            assert not self._wrong
            assert self._heard == len(self._script), f"{self._script[self._heard :]} did not come"

    def _run(self) -> None:
        line = b""
        while True:
            ready, _, _ = select.select([self._master, self._over_read], [], [])
            if self._over_read in ready:
                return
            with suppress(OSError):
                line += os.read(self._master, 4096)
            *commands, line = line.split(b"\n")
            for command in commands:
                if self._understood():
                    self._answer(command.strip())
                else:
                    self.send(self._noise)

    def _understood(self) -> bool:
        speeds = termios.tcgetattr(self._master)[4:6]
        wanted = getattr(termios, f"B{self._baud}", None)
        return self._baud is None or speeds == [wanted, wanted]

    def _answer(self, command: bytes) -> None:
        with self._changed:
            expected, answer = self._script[self._heard] if self._heard < len(self._script) else (b"nothing", b"")
            if command != expected:
                self._wrong.append(f"{command!r} came, {expected!r} was expected")
            else:
                self.send(answer)
                self._heard += 1
            self._changed.notify_all()


@contextmanager
def no_thread_left() -> Iterator[None]:
    """What is done inside leaves no thread behind."""
    before = set(threading.enumerate())
    yield
    deadline = time.monotonic() + LONG
    while left := set(threading.enumerate()) - before:
        assert time.monotonic() < deadline, left
        next(iter(left)).join(0.1)
