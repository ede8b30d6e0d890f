"""Display of the meters of the limited quantities."""

from collections.abc import Mapping, Sequence
from math import inf, isfinite

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QHelpEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from bench.app.display import texts
from bench.app.display.meters import SOON, Meter, meters_of
from bench.app.display.theme import Theme
from bench.app.ipc.messages import Traces
from bench.config.model import BenchConfiguration
from bench.preflight.margins import Margin

LEAST_ROW, LARGEST_ROW = 30, 52
"""Smallest and largest height of a meter [px]."""


class MetersView(QWidget):
    """The meters, one below the other, each with a bar of the magnitude, a line at the peak, and a triangle at the
    planned value.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.meters: list[Meter] = []
        self._live = False
        self.setAccessibleName(texts.NAMES["meters"])
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)

    def use(self, configuration: BenchConfiguration, margins: Sequence[Margin] = ()) -> None:
        """Show the limits of a bench, and the planned values of a run."""
        self.meters = meters_of(configuration, margins)
        self.setMinimumHeight(len(self.meters) * LEAST_ROW)
        self.updateGeometry()
        self.update()

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        self.update()

    def add(self, traces: Sequence[Traces]) -> None:
        """Add the magnitudes of blocks."""
        for block in traces:
            self._add(block.begin, block.magnitudes)
        if traces:
            self.update()

    def show_live(self, *, live: bool) -> None:
        """Draw the meters in colour while their values are live, otherwise in grey."""
        if live != self._live:
            self._live = live
            self.update()

    @property
    def _row(self) -> float:
        """Height of a meter [px]."""
        return min(self.height() / max(len(self.meters), 1), LARGEST_ROW)

    def sizeHint(self) -> QSize:
        return QSize(220, len(self.meters) * 40)

    def _add(self, time: float, magnitudes: Mapping[str, float]) -> None:
        for meter in self.meters:
            if meter.key in magnitudes:
                meter.add(time, magnitudes[meter.key])

    def event(self, event: object) -> bool:
        """Show the numbers of the meter under the pointer as a tooltip."""
        if isinstance(event, QHelpEvent) and self.meters:
            place = min(int(event.pos().y() / self._row), len(self.meters) - 1)
            QToolTip.showText(event.globalPos(), self.meters[place].explanation, self)
            return True
        return super().event(event)  # type: ignore[arg-type]

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002 - the signature is Qt's
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        height = self._row
        font = QFont(self.font())
        font.setPixelSize(max(min(int(0.42 * height), 15), 11))
        painter.setFont(font)
        for row, meter in enumerate(self.meters):
            self._paint(painter, meter, QRectF(4, row * height, self.width() - 8, height))
        painter.end()

    def _paint(self, painter: QPainter, meter: Meter, area: QRectF) -> None:
        theme, bar = self._theme, min(0.28 * area.height(), 10.0)
        words = QRectF(area.x(), area.y(), area.width(), area.height() - bar - 5)
        painter.setPen(QColor(theme.text if self._live else theme.faint))
        bottom = Qt.AlignmentFlag.AlignBottom
        soon = meter.time_to_limit if self._live else inf
        text = meter.text
        if soon <= SOON:
            painter.setPen(QColor(theme.alarm))
            text = texts.TIME_TO_LIMIT.format(seconds=soon)
        painter.drawText(words, bottom | Qt.AlignmentFlag.AlignRight, text)
        used = painter.fontMetrics().horizontalAdvance(text) + 6
        name = painter.fontMetrics().elidedText(meter.name, Qt.TextElideMode.ElideRight, int(words.width() - used))
        painter.drawText(words, bottom | Qt.AlignmentFlag.AlignLeft, name)
        groove = QRectF(area.x(), area.bottom() - bar - 3, area.width(), bar)
        painter.setPen(QPen(QColor(theme.faint), 1))
        painter.setBrush(QColor(theme.raised))
        painter.drawRect(groove)
        if isfinite(meter.value):
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(getattr(theme, meter.level) if self._live else theme.faint))
            share = min(meter.value / meter.limit, 1.0)
            painter.drawRect(QRectF(groove.x(), groove.y(), share * groove.width(), bar))
            place = groove.x() + min(meter.peak / meter.limit, 1.0) * groove.width()
            painter.setPen(QPen(QColor(theme.text), 2))
            painter.drawLine(QPointF(place, groove.y() - 1), QPointF(place, groove.bottom() + 1))
        if isfinite(meter.planned):
            place = groove.x() + min(meter.planned, 1.0) * groove.width()
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.wait))
            foot = groove.bottom() + 3
            corners = [QPointF(place, groove.bottom() - 4), QPointF(place - 5, foot), QPointF(place + 5, foot)]
            painter.drawPolygon(QPolygonF(corners))
