"""The first minute: four steps, the next one marked; each is ticked off when it was really done."""

from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout

from bench.events import PointFinished
from bench.gui import texts
from bench.gui.controller import Controller
from bench.gui.header import set_level
from bench.link.messages import Ended, Surveyed

DONE, NEXT, LATER = "✓", "▶", "○"


class Tour(QFrame):
    """Follows the controller; it says what to do and does nothing itself."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("welcome")
        self.setAccessibleName(texts.NAMES["tour"])
        self.step = 0
        self._wanted, self._reasons = True, set[str]()
        self.steps = [QLabel(wordWrap=True) for _ in texts.TOUR]
        row = QHBoxLayout()
        for label in self.steps:
            row.addWidget(label, 1)
        hide = QPushButton(texts.WELCOME_CLOSE)
        hide.clicked.connect(self.leave)
        whole = QHBoxLayout(self)
        words = QVBoxLayout()
        words.addWidget(QLabel(texts.WELCOME, wordWrap=True))
        words.addLayout(row)
        whole.addLayout(words, 1)
        whole.addWidget(hide)
        controller.surveyed.connect(self._surveyed)
        controller.began.connect(lambda: self._reach(2))
        controller.told.connect(self._tell)
        controller.ended.connect(self._ended)
        self._show()

    def leave(self) -> None:
        """No longer wanted."""
        self._wanted = False
        self.setVisible(False)

    def give_way(self, reason: str, *, to: bool) -> None:
        """Hide while there is a `reason` to: something more important needs the room, or the bench is a real one."""
        (self._reasons.add if to else self._reasons.discard)(reason)
        self.setVisible(self._wanted and not self._reasons)

    def _surveyed(self, found: object) -> None:
        if self.step < 2:
            self._go(1 if isinstance(found, Surveyed) and found.refusal is None else 0)

    def _tell(self, event: object) -> None:
        if isinstance(event, PointFinished):
            self._reach(3)

    def _ended(self, ended: object) -> None:
        """A run that did not come to its end is begun again."""
        self._go(len(self.steps) if self.step == 3 and isinstance(ended, Ended) else 0)

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
