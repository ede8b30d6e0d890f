"""The key of STOP while another program has the focus, on a real X server."""

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication, QWidget

from bench.app.gui.global_key import GlobalKey
from tests.bench.app.gui.virtual_screen import NEEDED, Screen, missing, virtual_screen
from tests.patience import LONG


class Window:
    """A program with the window `tests.bench.app.gui.key_holder`."""

    def __init__(self, screen: Screen, title: str, process: "subprocess.Popen[str]") -> None:
        self.screen, self.title, self._process = screen, title, process
        self._lines: SimpleQueue[str] = SimpleQueue()
        Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line.strip())

    def focus(self) -> None:
        self.screen.focus(self.title, lambda: self._process.poll() is not None)

    def says(self, *lines: str) -> None:
        """The next lines are these."""
        assert [self._lines.get(timeout=LONG) for _ in lines] == list(lines)

    def is_silent(self) -> bool:
        return self._lines.empty()


@contextmanager
def shown(screen: Screen, title: str) -> Generator[Window]:
    """The window, with the focus."""
    path = os.pathsep.join(filter(None, (str(Path(__file__).parents[4]), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", "tests.bench.app.gui.key_holder", title]
    environment = {**screen.environment, "PYTHONPATH": path}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            window = Window(screen, title, process)
            window.focus()
            yield window
        finally:
            process.kill()


@contextmanager
def other_program(screen: Screen) -> Generator[None]:
    """A program with a plain window, which takes the focus and receives no key."""
    from xcffib import connect
    from xcffib.xproto import InputFocus, WindowClass

    server: Any = connect(display=screen.display)
    root = server.get_setup().roots[0]
    window = server.generate_id()
    kind = WindowClass.InputOutput
    server.core.CreateWindow(root.root_depth, window, root.root, 900, 600, 50, 50, 0, kind, root.root_visual, 0, [])
    server.core.MapWindowChecked(window).check()
    server.core.SetInputFocusChecked(InputFocus.PointerRoot, window, 0).check()
    yield
    server.disconnect()


@pytest.mark.skipif(os.name != "posix", reason="a virtual X server is a POSIX thing")
@pytest.mark.skipif(bool(missing()), reason=f"needs {' and '.join(NEEDED)}; missing here: {missing()}")
def test_the_key_acts_without_the_focus_and_else_belongs_to_the_window_that_has_it(tmp_path: Path) -> None:
    with virtual_screen(tmp_path) as screen, shown(screen, "first") as first:
        first.says("active")
        screen.press("F12")
        first.says("typed")
        with other_program(screen):
            first.says("held")
            screen.press("F12")
            first.says("pressed")
            # held down, it acts once
            screen.do("keydown", "F12", "sleep", "1.2", "keyup", "F12")
            screen.press("ctrl+F12")
            first.says("pressed", "pressed")
            with shown(screen, "second") as second:
                second.says("active")
                screen.press("F12")
                second.says("typed")
                # the other window of the program has the key
                with other_program(screen):
                    second.says("refused")
                    screen.press("F12")
                    first.says("pressed")
            assert first.is_silent()
            assert second.is_silent()


def test_without_an_x_server_the_key_is_not_grabbed(qapp: QApplication) -> None:
    assert qapp.platformName() == "offscreen"
    key = GlobalKey(QWidget())
    key.hold(wanted=True)
    assert not key.held
