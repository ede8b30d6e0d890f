"""The guided tour: the first run on the simulated bench, one step at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from bench.app.display import texts
from bench.app.gui.controller import Controller
from bench.app.gui.widgets import set_level
from bench.app.ipc.messages import Ended, PlanChecked
from bench.events import PointFinished

DONE, NEXT, LATER = "✓", "▶", "○"


@dataclass(frozen=True)
class Place:
    """Location of a step: `show` opens its page, and `control` is the control to be framed, if the step has one."""

    show: Callable[[], None]
    control: QWidget | None = None


class Tour(QFrame):
    """The guided tour. It performs no step itself, and stays at each one until the user has done it; the control of the
    current step is framed, and *Show me* opens its page.
    """

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("welcome")
        self.setAccessibleName(texts.NAMES["tour"])
        self.step, self._ran = 0, False
        self._wanted, self._reasons = True, set[str]()
        self._places: Sequence[Place] = ()
        self.welcome = QLabel(texts.WELCOME, wordWrap=True)
        self.steps = [QLabel(wordWrap=True) for _ in texts.TOUR]
        row = QHBoxLayout()
        for label in self.steps:
            row.addWidget(label, 1)
        self.show_me, hide = QPushButton(texts.TOUR_SHOW), QPushButton(texts.WELCOME_CLOSE)
        self.show_me.setToolTip(texts.TOUR_SHOW_TIP)
        self.show_me.clicked.connect(self._show_place)
        hide.clicked.connect(self.leave)
        whole = QHBoxLayout(self)
        words = QVBoxLayout()
        words.addWidget(self.welcome)
        words.addLayout(row)
        whole.addLayout(words, 1)
        whole.addWidget(self.show_me)
        whole.addWidget(hide)
        controller.plan_checked.connect(self._plan_checked)
        controller.began.connect(lambda: self._reach(2))
        controller.event_received.connect(self._tell)
        controller.ended.connect(self._ended)
        self._show()

    def guide(self, places: Sequence[Place]) -> None:
        """Set the locations of the steps, in order, and frame the control of the current one."""
        self._places = tuple(places)
        self._show()

    def read_results(self) -> None:
        """Complete the last step, if it has been reached."""
        if self.step == len(self.steps) - 1 and self._ran:
            self._go(len(self.steps))

    def leave(self) -> None:
        """Close the tour permanently."""
        self._wanted = False
        self.setVisible(False)
        self._frame()

    def give_way(self, reason: str, *, to: bool) -> None:
        """Hide while `to` is True for any `reason`: more important content needs the space, or the bench is not
        simulated.
        """
        (self._reasons.add if to else self._reasons.discard)(reason)
        self.setVisible(self._wanted and not self._reasons)
        self._frame()

    def _plan_checked(self, found: object) -> None:
        if self.step < 2:
            self._go(1 if isinstance(found, PlanChecked) and found.refusal is None else 0)

    def _tell(self, event: object) -> None:
        if isinstance(event, PointFinished):
            self._reach(3)

    def _ended(self, ended: object) -> None:
        """Wait for the results to be read; after an interrupted run, return to the first step."""
        self._ran = self.step >= 3 and isinstance(ended, Ended)
        if not self._ran:
            self._go(0)

    def _reach(self, step: int) -> None:
        self._go(max(self.step, step))

    def _go(self, step: int) -> None:
        self.step = step
        self._show()

    def _show(self) -> None:
        for place, (label, text) in enumerate(zip(self.steps, texts.TOUR, strict=True)):
            mark = DONE if place < self.step else NEXT if place == self.step else LATER
            label.setText(f"{mark} {place + 1}. {text}")
            set_level(label, "wait" if mark == NEXT else "calm")
            _set_guided(label, mark == NEXT)
        complete = self.step == len(self.steps)
        self.welcome.setText(texts.TOUR_COMPLETE if complete else texts.WELCOME)
        self.show_me.setVisible(not complete and bool(self._places))
        self._frame()

    def _frame(self) -> None:
        """Frame the control of the current step while the tour is shown."""
        shown = self._wanted and not self._reasons
        for place, each in enumerate(self._places):
            if each.control is not None:
                _set_guided(each.control, shown and place == self.step)

    def _show_place(self) -> None:
        if self.step < len(self._places):
            self._places[self.step].show()


def _set_guided(part: QWidget, guided: bool) -> None:
    """Frame a part, or remove its frame; Qt evaluates a changed property only on request."""
    value = "yes" if guided else "no"
    if part.property("guided") != value:
        part.setProperty("guided", value)
        part.style().unpolish(part)
        part.style().polish(part)
