"""Panels between header and pages: the question to the operator, and the question before closing the window."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.display.typography import typeset
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import give_key
from bench.app.ipc.messages import Question
from bench.events import Event, OperatorAsked
from drivers.rig import OperatorTask

UNREAD = 700
"""Time after the appearance of a question during which no answer is accepted [ms]: nobody can have read it yet."""


_AT_ZERO = "The output is at zero and the rig is stopped until you answer."
_ARMING = (
    "Before arming, every safety input must be good. Then, at rest, every sensor must give valid readings and the "
    "storeys must be still. The table moves only after these checks."
)
_NOT_CHECKED = "No sensor detects whether this task is done, so make sure before you answer. {what}"
UNKNOWN_TASK = (
    f"The plan requires this task. {_AT_ZERO}",
    "The safety inputs are checked whenever the rig is armed. No sensor detects whether this task is done, so make "
    "sure before you answer.",
)
TASKS = {
    OperatorTask.MOUNT_SPRING: (f"The next points require this spring between frame and block. {_AT_ZERO}", _ARMING),
    OperatorTask.REMOVE_BLOCK: (f"The next test measures the bare frame. {_AT_ZERO}", _ARMING),
    OperatorTask.STAND_BLOCK_UP: (f"The block has fallen and must be set up before the next test. {_AT_ZERO}", _ARMING),
    OperatorTask.LOCK_FRAME: (
        f"The storeys must move with the table, so that every sensor measures the same motion. {_AT_ZERO}",
        _NOT_CHECKED.format(what="The table may move next, with the storeys clamped to it."),
    ),
    OperatorTask.UNLOCK_FRAME: (
        f"The next tests require a free frame. {_AT_ZERO}",
        _NOT_CHECKED.format(what="A clamp left on a storey is not detected before the next test."),
    ),
    OperatorTask.HOLD_BLOCK: (
        f"The spring is measured with the block clamped, so that it cannot lift. {_AT_ZERO}",
        _NOT_CHECKED.format(what="An unclamped block distorts the measurement and may fall."),
    ),
    OperatorTask.LOCK_TABLE: (
        f"The manual release must not move the table. {_AT_ZERO} A clamped table is not driven.",
        _NOT_CHECKED.format(what="Tests with a clamped table are recorded without a drive signal."),
    ),
    OperatorTask.UNLOCK_TABLE: (
        f"The table must be free before it is driven again. {_AT_ZERO}",
        _NOT_CHECKED.format(what="Driving the table against its clamp can overload the shaker."),
    ),
    OperatorTask.WATCH_BLOCK: (
        f"Laser 2 measures the rocking of the block. {_AT_ZERO}",
        "Before arming, every safety input must be good. Then, at rest, the laser must give valid readings. The guard "
        "does not monitor the drift while the laser points at the block. The table is not driven.",
    ),
    OperatorTask.WATCH_STOREYS: (
        f"Laser 2 must point at storey 2 again, since the guard monitors the drift with it. {_AT_ZERO}",
        _NOT_CHECKED.format(what="The next test zeroes the signal at the new target."),
    ),
    OperatorTask.TILT_BLOCK: (
        f"The block must start from this tilt, without a push. {_AT_ZERO} The output stays at zero during the "
        "recording.",
        "Before arming, every safety input must be good. Afterwards, the recording must show that the block was "
        "released and rocked. The table does not move.",
    ),
    OperatorTask.PULL_FRAME: (
        f"The frame must start from this displacement, without a push. {_AT_ZERO} The output stays at zero "
        "during the recording.",
        "Before arming, every safety input must be good. Afterwards, the recording must show that the frame was "
        "released. The table does not move.",
    ),
}
"""Reason for each operator task, and the checks after it."""


class Prompt(QFrame):
    """Panel with an operator task, its reason, and the checks that follow; hidden while no question is open."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("prompt")
        self._operator_event: OperatorAsked | None = None
        self.request = QLabel(wordWrap=True)
        self.request.setProperty("role", "value")
        self.done, self.decline = QPushButton(texts.DONE), QPushButton(texts.DECLINE)
        # an unintended key press must not answer the question
        for button, key, tip in (
            (self.done, texts.DONE_KEY, texts.DONE_TIP),
            (self.decline, texts.DECLINE_KEY, texts.DECLINE_TIP),
        ):
            button.setAutoDefault(False)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            give_key(button, key)
            button.setToolTip(tip)
        self.done.clicked.connect(lambda: controller.answer(agreed=True))
        self.decline.clicked.connect(lambda: controller.answer(agreed=False))
        self._unread = QTimer(self, interval=UNREAD, singleShot=True)
        self._unread.timeout.connect(lambda: self._take_answers(True))
        words = QVBoxLayout()
        words.addWidget(QLabel(texts.PROMPT))
        words.addWidget(self.request)
        self.parts = tuple(QLabel(wordWrap=True) for _ in texts.PROMPT_PARTS)
        for part in self.parts:
            part.setProperty("role", "faint")
            words.addWidget(part)
        row = QHBoxLayout(self)
        row.addLayout(words, 1)
        row.addWidget(self.done)
        row.addWidget(self.decline)
        self.hide()
        controller.event_received.connect(self._tell)
        controller.question_changed.connect(self._ask)

    def _tell(self, event: Event) -> None:
        """Store the event that precedes the question and contains the kind of task."""
        if isinstance(event, OperatorAsked):
            self._operator_event = event

    def _ask(self, question: Question | None) -> None:
        self.setVisible(question is not None)
        if question is None:
            return
        self._take_answers(False)
        self._unread.start()
        self.request.setText(typeset(question.request))
        known = self._operator_event is not None and self._operator_event.request == question.request
        work = self._operator_event.work if known and self._operator_event is not None else None
        said = UNKNOWN_TASK if work is None else TASKS[work]
        for label, name, text in zip(self.parts, texts.PROMPT_PARTS, said, strict=True):
            label.setText(f"{name}: {text}")

    def _take_answers(self, taken: bool) -> None:
        for button in (self.done, self.decline):
            button.setEnabled(taken)


SHARE, LEAST = 0.6, 70
"""Largest fraction of the window below the header that panels may occupy, and the lower bound of this limit
[px].
"""


class PanelArea(QScrollArea):
    """Stack of panels, as high as their contents; it scrolls in a low window."""

    def __init__(self, panels: Sequence[QWidget]) -> None:
        super().__init__(widgetResizable=True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._panels = tuple(panels)
        self._available = 0
        content = QWidget()
        self._column = QVBoxLayout(content)
        self._column.setContentsMargins(0, 0, 0, 0)
        for panel in panels:
            self._column.addWidget(panel)
        self.setWidget(content)
        content.installEventFilter(self)
        for panel in panels:
            panel.installEventFilter(self)

    def fit(self, available: int) -> None:
        """Set the height to that of the contents, up to a fraction of the `available` height [px]."""
        self._available = available
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Update the height, since a narrower area needs more height for its text."""
        super().resizeEvent(event)
        if event.size().width() != event.oldSize().width():
            self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Update the height when panels are shown, hidden or filled."""
        if event.type() in (QEvent.Type.ShowToParent, QEvent.Type.HideToParent, QEvent.Type.LayoutRequest):
            self._fit()
            if event.type() == QEvent.Type.ShowToParent:
                self.verticalScrollBar().setValue(0)
        return super().eventFilter(watched, event)

    def _fit(self) -> None:
        shown = [panel for panel in self._panels if not panel.isHidden()]
        self.setVisible(bool(shown))
        flows = self._column.hasHeightForWidth()
        needed = self._column.totalHeightForWidth(self.width()) if flows else self._column.totalSizeHint().height()
        height = min(needed, max(round(SHARE * self._available), LEAST))
        if height != self.height() or height != self.maximumHeight():
            self.setFixedHeight(height)


class LeavePanel(QFrame):
    """A panel that asks whether to close the window during a run; `leave` closes it."""

    def __init__(self, leave: Callable[[], None]) -> None:
        super().__init__()
        self.setObjectName("leave")
        self.question = QLabel(wordWrap=True)
        self.close_window, self.stay = QPushButton(texts.LEAVE_WINDOW), QPushButton(texts.STAY)
        self.close_window.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.close_window.clicked.connect(leave)
        self.stay.clicked.connect(self.hide)
        row = QHBoxLayout(self)
        row.addWidget(self.question, 1)
        row.addWidget(self.stay)
        row.addWidget(self.close_window)
        self.hide()

    def ask(self, *, goes_on: bool) -> None:
        """Show the question; `goes_on` is True if the run continues without the window."""
        self.question.setText(texts.LEAVE_GOES_ON if goes_on else texts.LEAVE_RAMPS_OUT)
        self.show()
        self.stay.setFocus()
