"""A question of the plan, inline: it covers nothing, and STOP stays in reach."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout

from bench.events import Event, OperatorAsked
from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.controller import Controller
from bench.link.messages import Question

UNREAD = 700
"""No answer is taken for so long after a question has appeared [ms]: it cannot have been read yet."""


class Prompt(QFrame):
    """Says what to do, why, and what is checked afterwards; hidden while nothing is asked."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("prompt")
        self._asked: OperatorAsked | None = None
        self.request = QLabel(wordWrap=True)
        self.request.setProperty("role", "value")
        self.done, self.decline = QPushButton(texts.DONE), QPushButton(texts.DECLINE)
        # a key that was meant for something else must not answer
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
        controller.told.connect(self._tell)
        controller.asked.connect(self._ask)

    def _tell(self, event: Event) -> None:
        """The event comes before the question, and says of which kind the work is."""
        if isinstance(event, OperatorAsked):
            self._asked = event

    def _ask(self, question: Question | None) -> None:
        self.setVisible(question is not None)
        if question is None:
            return
        self._take_answers(False)
        self._unread.start()
        self.request.setText(question.request)
        known = self._asked is not None and self._asked.request == question.request
        work = self._asked.work if known and self._asked is not None else None
        said = texts.HANDWORK_UNKNOWN if work is None else texts.HANDWORK[work]
        for label, name, text in zip(self.parts, texts.PROMPT_PARTS, said, strict=True):
            label.setText(f"{name}: {text}")

    def _take_answers(self, taken: bool) -> None:
        for button in (self.done, self.decline):
            button.setEnabled(taken)
