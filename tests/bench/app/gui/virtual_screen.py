"""A screen that nobody sees, with real windows and real keys: Xvfb and xdotool."""

import os
import shutil
import subprocess
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.patience import LONG

NEEDED = ("Xvfb", "xdotool")
SIZE = (1400, 900)


def missing() -> str:
    """Which of the programs is not installed; empty when none is missing."""
    return ", ".join(name for name in NEEDED if shutil.which(name) is None)


def until(condition: Callable[[], object], what: str) -> None:
    """Wait; raises AssertionError with `what` when it never comes true."""
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.3)


@dataclass(frozen=True)
class Screen:
    """A running X server; its picture lies in `folder`."""

    display: str
    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        """For programs that are to show themselves here."""
        return {**os.environ, "DISPLAY": self.display, "QT_QPA_PLATFORM": "xcb", "QT_SCALE_FACTOR": "1"}

    def do(self, *arguments: str) -> str:
        """Run xdotool; empty when it found nothing."""
        done = subprocess.run(
            ["xdotool", *arguments], env=self.environment, capture_output=True, text=True, check=False, timeout=LONG
        )
        return done.stdout.strip()

    def focus(self, title: str, over: Callable[[], bool]) -> str:
        """Wait for the window called `title`, unless its program is `over`; give it the keyboard as a window manager
        would. Returns its number.
        """
        until(lambda: self.do("search", "--onlyvisible", "--name", title) or over(), f"no window {title}")
        assert not over(), "the program ended"
        number = self.do("search", "--onlyvisible", "--name", title).splitlines()[0]
        self.do("windowmove", number, "0", "0")
        self.do("windowfocus", "--sync", number)
        return number

    def press(self, key: str) -> None:
        """Press and release a key of the keyboard, whoever has it."""
        self.do("key", key)

    def picture(self) -> NDArray[np.uint8]:
        """What is seen, shape (height, width, 3): the X window dump that Xvfb keeps in its frame buffer file.

        Source: XWDFile.h of X11: header of 32 bit numbers, most significant byte first, then the colour map.
        """
        dump = (self.folder / "Xvfb_screen0").read_bytes()
        header = np.frombuffer(dump, ">u4", 25)
        size, width, height, line, colours = (int(header[k]) for k in (0, 4, 5, 12, 19))
        begin = size + 12 * colours
        pixels = np.frombuffer(dump, np.uint8, line * height, begin).reshape(height, line)
        return pixels[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1]


@contextmanager
def virtual_screen(folder: Path) -> Generator[Screen, None, None]:
    """An X server of its own, on a display that is free."""
    reader, writer = os.pipe()
    geometry = f"{SIZE[0]}x{SIZE[1]}x24"
    command = ["Xvfb", "-displayfd", str(writer), "-screen", "0", geometry, "-fbdir", str(folder), "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[writer], stderr=subprocess.DEVNULL) as server:
        os.close(writer)
        try:
            with os.fdopen(reader) as told:
                number = told.readline().strip()
            assert number, "the X server did not start"
            yield Screen(f":{number}", folder)
        finally:
            server.terminate()
