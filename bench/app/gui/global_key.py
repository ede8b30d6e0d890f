"""The key of STOP while another program has the focus, where the platform permits it: on an X server.

Elsewhere the key needs the focus: Windows reserves F12 for debuggers (Microsoft's page on RegisterHotKey), and Wayland
sends keys only to the program that has the focus.
"""

from importlib import import_module
from typing import Any

from PySide6.QtCore import QObject, QSocketNotifier, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget

_F12 = 0xFFC9
"""Keysym of F12 (keysymdef.h of X11)."""

_PRESS, _RELEASE = 2, 3
"""Numbers of the events KeyPress and KeyRelease in the X protocol."""


class GlobalKey(QObject):
    """The key F12 of the X server, which is grabbed while `hold` requests it and no other program has grabbed it.

    If another window of this program has the focus, it receives the key as usual, because it may show another run.
    """

    pressed = Signal()
    """Emitted once per press of the grabbed key; a key held down repeats nothing."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._widget = parent
        self._wanted = False
        self._x: Any = None
        self._released_at = -1
        self._notifier: QSocketNotifier | None = None

    @property
    def held(self) -> bool:
        """Whether the key is grabbed."""
        return self._x is not None

    def hold(self, *, wanted: bool) -> None:
        """Grab or release the key; without effect if that was the last request."""
        if wanted == self._wanted:
            return
        self._wanted = wanted
        if not wanted:
            self._disconnect()
        elif QGuiApplication.platformName() == "xcb":
            self._connect()

    def _connect(self) -> None:
        try:
            # an extra of Linux, whose functions have no types
            xcffib: Any = import_module("xcffib")
            protocol: Any = import_module("xcffib.xproto")
        except (ImportError, OSError):
            return
        try:
            self._x = xcffib.connect()
            setup = self._x.get_setup()
            least = setup.min_keycode
            keyboard = self._x.core.GetKeyboardMapping(least, setup.max_keycode - least + 1).reply()
            place = list(keyboard.keysyms).index(_F12)
            asynchronous = protocol.GrabMode.Async
            for screen in setup.roots:
                self._x.core.GrabKeyChecked(
                    False,
                    screen.root,
                    protocol.ModMask.Any,
                    least + place // keyboard.keysyms_per_keycode,
                    asynchronous,
                    asynchronous,
                ).check()
        except (xcffib.XcffibException, ValueError):
            # grabbed by another program, or a keyboard without F12
            self._disconnect()
            return
        self._notifier = QSocketNotifier(self._x.get_file_descriptor(), QSocketNotifier.Type.Read, self)
        self._notifier.activated.connect(self._take)

    def _disconnect(self) -> None:
        """Close the connection, which releases the key."""
        if self._notifier is not None:
            self._notifier.setEnabled(False)
            self._notifier.deleteLater()
            self._notifier = None
        x, self._x = self._x, None
        if x is not None:
            x.disconnect()

    def _take(self) -> None:
        xcffib: Any = import_module("xcffib")
        try:
            # a press may end the grab
            while self._x is not None and (event := self._x.poll_for_event()) is not None:
                number = event.response_type & 0x7F
                if number == _RELEASE:
                    self._released_at = event.time
                # the server repeats a key held down as release and press at the same time
                elif number == _PRESS and event.time != self._released_at and not self._pass_on(event):
                    self.pressed.emit()
        except xcffib.XcffibException:
            # the server has gone
            self._disconnect()

    def _pass_on(self, event: Any) -> bool:
        """Send the key to the window that has the focus if that is another one of this program."""
        core = self._x.core
        focus = core.GetInputFocus().reply().focus
        protocol: Any = import_module("xcffib.xproto")

        def class_of(window: int) -> bytes:
            kind = core.GetProperty(False, window, protocol.Atom.WM_CLASS, protocol.Atom.STRING, 0, 64).reply()
            return bytes(kind.value.buf())

        # 0 and 1 stand for no window and for the one below the pointer
        own = int(self._widget.window().winId())
        if focus in (0, 1, own) or class_of(focus) != class_of(own):
            return False
        event.event, event.child = focus, 0
        core.SendEvent(False, focus, protocol.EventMask.KeyPress, event.pack())
        self._x.flush()
        return True
