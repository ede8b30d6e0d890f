"""The verdict of a run, in the largest font that fits."""

from collections.abc import Sequence

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QFont, QFontMetrics, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QLabel, QSizePolicy

from bench.app.display import texts

LARGEST, SMALLEST = 48, 14
"""Range of the font size [px]."""
STRETCH = 80
"""Width of the letters relative to their normal width [%]."""
UNBROKEN = 24
"""Greatest length of a part of the sentence that is kept on one line [characters]."""
SPACE = 0.31
"""Largest fraction of the page's height that the sentence may occupy."""
FLAGS = int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft)


class VerdictLabel(QLabel):
    """Wrapped text in the largest font size that fits; the tooltip shows the complete text."""

    def __init__(self) -> None:
        super().__init__(wordWrap=True)
        self.setAccessibleName(texts.NAMES["alpha"])
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self._space = 3 * LARGEST
        self.sentence = ""
        self._size = LARGEST

    def show_sentence(self, sentence: str) -> None:
        """Show a sentence."""
        if sentence != self.sentence:
            self.sentence = sentence
            self.setText(" · ".join(_unbroken(part) for part in sentence.split(" · ")))
            self.setToolTip(sentence)
            self._fit()

    def allow(self, page: int) -> None:
        """Limit the height to `SPACE` times `page`, the height of the page [px]."""
        self._space = round(SPACE * page)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Choose the font size for the new width."""
        super().resizeEvent(event)
        if event.size().width() != event.oldSize().width():
            self._fit()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        """Draw the sentence with narrow letters, which a style sheet cannot set."""
        painter = QPainter(self)
        painter.setFont(_font(self.font(), self._size))
        painter.setPen(self.palette().color(self.foregroundRole()))
        painter.drawText(self.contentsRect(), FLAGS, self.text())
        painter.end()

    def sizeHint(self) -> QSize:
        return QSize(0, self._box(self.pixels).height())

    @property
    def pixels(self) -> int:
        """Largest font size with which the text fits [px]; `SMALLEST` if it fits with none."""
        sizes: Sequence[int] = range(LARGEST, SMALLEST, -2)
        return next((size for size in sizes if self._fits(self._box(size))), SMALLEST)

    def _fits(self, box: QRect) -> bool:
        # an unbroken part may be wider than the label
        return box.height() <= self._space and box.width() <= max(self.width(), 1)

    def _box(self, pixels: int) -> QRect:
        box = QRect(0, 0, max(self.width(), 1), 10_000)
        return QFontMetrics(_font(self.font(), pixels)).boundingRect(box, FLAGS, self.text())

    def _fit(self) -> None:
        self._size = self.pixels
        self.setFixedHeight(min(self._box(self._size).height(), self._space))
        self.update()


def _unbroken(part: str) -> str:
    """The part with no-break characters, so that it stays on one line; unchanged if longer than `UNBROKEN`."""
    joined = part.replace(" ", "\N{NO-BREAK SPACE}").replace("/", "/\N{WORD JOINER}")
    return joined if len(part) <= UNBROKEN else part


def _font(font: QFont, pixels: int) -> QFont:
    large = QFont(font)
    large.setPixelSize(pixels)
    large.setStretch(STRETCH)
    return large
