# pyright: reportUnknownMemberType=false
"""Shared parts of the pages: lamp, keys of buttons, levels of labels, axes of plots, and the file dialog."""

from collections.abc import Callable
from math import floor, log10
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt
from PySide6.QtGui import (
    QColor,
    QKeySequence,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QResizeEvent,
    QShortcut,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QFileDialog,
    QFrame,
    QLabel,
    QScrollArea,
    QSizePolicy,
    QWidget,
)

from bench.app.display import texts
from bench.app.display.status import Shape
from bench.app.display.theme import Theme
from bench.app.gui.controller import Controller

SIDE = 56
"""Width and height of a lamp [px]."""


class Lamp(QWidget):
    """A status lamp, whose shape and colour represent the state."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.shape: Shape = "ring"
        self._level = "calm"
        self._on_red = False
        self.setFixedSize(SIDE, SIDE)

    def show_as(self, shape: Shape, level: str, *, on_red: bool) -> None:
        """Change shape and colour; on a red background the colour is white."""
        if (shape, level, on_red) != (self.shape, self._level, self._on_red):
            self.shape, self._level, self._on_red = shape, level, on_red
            self.update()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw the shape."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colour = QColor("white" if self._on_red else str(getattr(self._theme, self._level)))
        painter.setPen(QPen(colour, 6))
        painter.setBrush(colour if self.shape not in ("ring", "cross") else Qt.BrushStyle.NoBrush)
        box = QRectF(6, 6, SIDE - 12, SIDE - 12)
        if self.shape in ("ring", "disc"):
            painter.drawEllipse(box)
        elif self.shape == "cross":
            painter.drawLine(box.topLeft(), box.bottomRight())
            painter.drawLine(box.topRight(), box.bottomLeft())
        else:
            painter.drawPolygon(_corners(self.shape, box))
        painter.end()


def _corners(shape: Shape, box: QRectF) -> QPolygonF:
    if shape == "octagon":
        places = ((0.3, 0), (0.7, 0), (1, 0.3), (1, 0.7), (0.7, 1), (0.3, 1), (0, 0.7), (0, 0.3))
    elif shape == "triangle":
        places = ((0.5, 0), (1, 1), (0, 1))
    else:
        places = ((0, 0), (1, 0), (1, 1), (0, 1))
    return QPolygonF([QPointF(box.x() + x * box.width(), box.y() + y * box.height()) for x, y in places])


def set_level(label: QLabel, level: str) -> None:
    """Give a label the style of a level; Qt evaluates a changed property only on request."""
    if label.property("level") != level:
        label.setProperty("level", level)
        label.style().unpolish(label)
        label.style().polish(label)


class ElidingLabel(QLabel):
    """A one-line label that never widens a page. A text that is too long ends in an ellipsis; the tooltip then shows
    the full text.
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(text)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw the part of the text that fits."""
        painter = QPainter(self)
        area = self.contentsRect()
        shown = self.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, area.width())
        if not self.toolTip() and shown != self.text():
            self.setToolTip(self.text())
        painter.setPen(self.palette().color(self.foregroundRole()))
        painter.drawText(area, int(self.alignment()), shown)
        painter.end()

    def setText(self, text: str) -> None:
        """Set the text, and clear the tooltip if the text has changed."""
        if text != self.text():
            super().setText(text)
            self.setToolTip("")


class _WheelFilter(QObject):
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: ARG002 - the signature is Qt's
        if event.type() == QEvent.Type.Wheel:
            # an ignored event is passed on to the page, which scrolls
            event.ignore()
            return True
        return False


def ignore_wheel(field: QWidget) -> None:
    """Ignore the wheel over a field, so that scrolling a page does not change its value."""
    field.installEventFilter(_WheelFilter(field))


FITTING = (860, 400)
"""Size of a page's contents below which the page scrolls [px]."""


def scrolling(content: QWidget, width: int, height: int) -> QScrollArea:
    """A scroll area around `content`, which scrolls in an area smaller than `width` x `height` [px]."""
    area = QScrollArea(widgetResizable=True)
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    holder = _Holder(content, width, height)
    area.setWidget(holder)
    # transparent, so that the page has the background of its tab
    for part in (holder, area.viewport()):
        part.setAutoFillBackground(False)
    return area


class _Holder(QWidget):
    """Widget of at least `width` x `height` [px] that `content` fills. It has no layout: with a layout, the scroll area
    would give wrapped text its preferred height and would scroll even if the contents fit.
    """

    def __init__(self, content: QWidget, width: int, height: int) -> None:
        super().__init__()
        self._content = content
        content.setParent(self)
        self.setMinimumSize(width, height)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._content.setGeometry(self.rect())


def give_key(button: QAbstractButton, key: str) -> None:
    """Make `key` press the button while the button is visible and enabled. A held key counts once, whereas the button's
    own shortcut would repeat.
    """
    shortcut = QShortcut(QKeySequence(key), button, autoRepeat=False)
    shortcut.activated.connect(button.click)


def colour_axes(plot: Any, theme: Theme) -> None:
    """Give the axes of a pyqtgraph plot item the colours of `theme`."""
    for side in ("left", "bottom"):
        axis = plot.getAxis(side)
        axis.setPen(theme.faint)
        axis.setTextPen(theme.text)
        axis.enableAutoSIPrefix(False)


def round_down(value: float) -> float:
    """The largest round number, such as 0.3 or 15, not above `value`, which is positive."""
    decade = 10.0 ** floor(log10(value))
    digits = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
    return max(digit * decade for digit in digits if digit * decade <= value * (1.0 + 1e-9))


def why_no_dialog(controller: Controller) -> str:
    """Reason why no dialog can be opened now; empty if one can."""
    return texts.START_BUSY if controller.running else controller.held


def ask_for_files(
    parent: QWidget,
    controller: Controller,
    title: str,
    kinds: str,
    taken: Callable[[list[Path]], None],
    *,
    folder: str = "",
    many: bool = False,
    folders: bool = False,
) -> None:
    """Show the dialog and return at once; `taken` is called with the selected files, or with the selected folder if
    `folders` is set. The start of a run or a queue closes the dialog.
    """
    dialog = QFileDialog(parent, title, folder, kinds)
    # a native dialog blocks the window, and STOP with it
    dialog.setOption(QFileDialog.Option.DontUseNativeDialog)
    one = QFileDialog.FileMode.Directory if folders else QFileDialog.FileMode.ExistingFile
    dialog.setFileMode(QFileDialog.FileMode.ExistingFiles if many else one)
    dialog.setOption(QFileDialog.Option.ShowDirsOnly, folders)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)

    def shut() -> None:
        if why_no_dialog(controller):
            dialog.reject()

    def take(names: list[str]) -> None:
        if not why_no_dialog(controller):
            taken([Path(name) for name in names])

    def let_go(_result: int) -> None:
        # a closure is not a slot of the dialog and would outlive it
        controller.changed.disconnect(shut)

    controller.changed.connect(shut)
    dialog.filesSelected.connect(take)
    dialog.finished.connect(let_go)
    # `open` would make the dialog modal
    dialog.show()
