"""A question of the plan, inline: it covers nothing, and STOP stays in reach."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout

from bench.gui import texts
from bench.gui.controller import Controller
from bench.link.messages import Question


class Prompt(QFrame):
    """Says what to do, why it is safe, and what is checked afterwards; hidden while nothing is asked."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("prompt")
        self.request = QLabel(wordWrap=True)
        self.request.setProperty("role", "value")
        self.done, self.decline = QPushButton(texts.DONE), QPushButton(texts.DECLINE)
        # a key that was meant for something else must not answer
        for button in (self.done, self.decline):
            button.setAutoDefault(False)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.done.clicked.connect(lambda: controller.answer(agreed=True))
        self.decline.clicked.connect(lambda: controller.answer(agreed=False))
        words = QVBoxLayout()
        words.addWidget(QLabel(texts.PROMPT))
        words.addWidget(self.request)
        why = QLabel(texts.PROMPT_WHY, wordWrap=True)
        words.addWidget(why)
        row = QHBoxLayout(self)
        row.addLayout(words, 1)
        row.addWidget(self.done)
        row.addWidget(self.decline)
        self.hide()
        controller.asked.connect(self._ask)

    def _ask(self, question: Question | None) -> None:
        self.setVisible(question is not None)
        if question is not None:
            self.request.setText(question.request)
