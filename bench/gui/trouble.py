"""What went wrong, inline below the header: one panel for a lost device, a failed start, a full disk, and the rest."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPlainTextEdit, QPushButton, QVBoxLayout

from bench.gui import texts
from bench.gui.buttons import give_key
from bench.gui.controller import Controller
from bench.gui.header import set_level
from bench.gui.troubles import Trouble, trouble_of
from bench.link.messages import Ended, Refused


class TroublePanel(QFrame):
    """Hidden while nothing is wrong. The newest trouble replaces an older one; a new run hides it."""

    def __init__(self, controller: Controller) -> None:
        super().__init__()
        self.setObjectName("trouble")
        self._controller = controller
        self.title = QLabel(f"▲ {texts.TROUBLE}")
        set_level(self.title, "alarm")
        self.answers = tuple(QLabel(wordWrap=True) for _ in texts.TROUBLE_PARTS)
        self.details = QPlainTextEdit(readOnly=True)
        self.details.setAccessibleName(texts.NAMES["details"])
        self.details.setMaximumHeight(160)
        self.more, self.close_it = QPushButton(texts.TROUBLE_DETAILS), QPushButton(texts.TROUBLE_CLOSE)
        self.more.setCheckable(True)
        self._arrange()
        self.hide()
        self.more.toggled.connect(self.details.setVisible)
        self.close_it.clicked.connect(self.hide)
        controller.began.connect(self._begin)
        controller.ended.connect(self._end)

    def show_trouble(self, trouble: Trouble) -> None:
        """Say it."""
        said = (trouble.what, trouble.did, trouble.now)
        for label, text in zip(self.answers, said, strict=True):
            label.setText(text)
        self.details.setPlainText(trouble.details)
        self.more.setVisible(bool(trouble.details))
        self.more.setChecked(False)
        self.details.hide()
        self.show()

    def _begin(self) -> None:
        self.hide()

    def _end(self, ended: Ended | Refused) -> None:
        trouble = trouble_of(ended, driven=self._controller.driven)
        if trouble is not None:
            self.show_trouble(trouble)

    def _arrange(self) -> None:
        self.more.setToolTip(texts.TROUBLE_DETAILS_TIP)
        give_key(self.more, "Ctrl+Shift+I")
        self.close_it.setToolTip(texts.TROUBLE_CLOSE_TIP)
        give_key(self.close_it, "Ctrl+Shift+H")
        grid = QGridLayout()
        for row, (name, label) in enumerate(zip(texts.TROUBLE_PARTS, self.answers, strict=True)):
            part = QLabel(name)
            part.setProperty("role", "faint")
            grid.addWidget(part, row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(label, row, 1)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        grid.setColumnStretch(1, 1)
        buttons = QHBoxLayout()
        buttons.addWidget(self.title, 1)
        buttons.addWidget(self.more)
        buttons.addWidget(self.close_it)
        column = QVBoxLayout(self)
        column.addLayout(buttons)
        column.addLayout(grid)
        column.addWidget(self.details)
