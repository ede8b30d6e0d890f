"""Meters of the limited quantities: present magnitude, limit, peak, planned value, and time to the limit."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QHelpEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from bench.app.gui import texts
from bench.app.gui.palette import Theme
from bench.app.gui.widgets import in_screen_unit
from bench.app.ipc.messages import Traces
from bench.config.model import BenchConfiguration
from bench.preflight.margins import Margin, bounds
from sim.channel import STOREYS

SPAN = 2.0
"""Length [s] of each of the two consecutive windows whose peaks give the growth of a quantity."""
GROWTH, NEAR = 0.02, 0.3
"""Least relative growth between the windows, and least share of the limit, for which a time to the limit is stated."""
SOON = 60.0
"""Longest stated time to a limit [s]."""
WARNED = 0.9
"""Share of its limit at or above which a quantity without a declared warning level is marked."""
LEAST_ROW, LARGEST_ROW = 30, 52
"""Height of a meter [px]."""
HIDDEN = ("drive_voltage", "drive_slew")
"""Limits without a meter: they apply to the command, which is checked before output, not to a measured signal."""


@dataclass
class Meter:
    """Magnitude of a quantity and its `limit`, both in SI units.

    warning : share of the limit at or above which the quantity is marked.
    planned : share of the limit below which 95 % of the specimens are predicted to stay; NaN if not predicted.
    """

    key: str
    name: str
    unit: str
    limit: float
    warning: float = WARNED
    planned: float = nan
    value: float = nan
    peak: float = 0.0
    _past: deque[tuple[float, float]] = field(default_factory=lambda: deque[tuple[float, float]]())

    def add(self, time: float, value: float) -> None:
        """Add the largest magnitude of a block at bench time `time` [s]."""
        if self._past and time < self._past[-1][0]:
            self._past.clear()
        self.value, self.peak = value, max(self.peak, value)
        self._past.append((time, value))
        while self._past[0][0] < time - 2.0 * SPAN:
            self._past.popleft()

    @property
    def time_to_limit(self) -> float:
        """Time until the limit at the present growth [s]; infinite if the quantity does not grow."""
        if not self._past:
            return inf
        newest = self._past[-1][0]
        if newest - self._past[0][0] < 1.5 * SPAN:
            return inf
        late = max((value for time, value in self._past if time > newest - SPAN), default=nan)
        early = max((value for time, value in self._past if time <= newest - SPAN), default=nan)
        if not late > (1.0 + GROWTH) * early or late < NEAR * self.limit:
            return inf
        return max(self.limit - late, 0.0) * SPAN / (late - early)

    @property
    def level(self) -> str:
        """Style level for the present magnitude."""
        share = self.value / self.limit
        return "alarm" if share >= 1.0 else "wait" if share >= self.warning else "good"

    @property
    def text(self) -> str:
        """Magnitude and limit in the displayed unit."""
        factor, unit = (100.0, "%") if self.unit == "1" else in_screen_unit(self.unit)
        value = f"{factor * self.value:.3g}" if isfinite(self.value) else texts.NO_VALUE
        return f"{value} / {factor * self.limit:.3g} {unit}"

    @property
    def explanation(self) -> str:
        """All numbers of the meter, for its tooltip."""
        factor, unit = (100.0, "%") if self.unit == "1" else in_screen_unit(self.unit)
        planned = texts.NO_VALUE if not isfinite(self.planned) else f"{factor * self.planned * self.limit:.3g} {unit}"
        peak = f"{factor * self.peak:.3g} {unit}"
        return texts.METER_TIP.format(name=self.name, text=self.text, peak=peak, planned=planned)


def meters_of(configuration: BenchConfiguration, margins: Sequence[Margin] = ()) -> list[Meter]:
    """Meters of a bench, with the planned values of a run with these `margins`."""
    likely = {each.bound.quantity: each.demand.likely for each in margins if each.demand.likely is not None}
    found = [
        Meter(
            key,
            texts.METERS.get(key, bound.name),
            bound.unit,
            bound.limit,
            float(getattr(configuration.limits.warning, "laser_range" if key in STOREYS else key, WARNED)),
            likely[key] / bound.limit if key in likely else nan,
        )
        for key, bound in bounds(configuration).items()
        if key not in HIDDEN
    ]
    further = [
        Meter(channel.name, channel.name.replace("_", " "), channel.unit, channel.limit)
        for channel in configuration.channels
        if channel.limit is not None
    ]
    return [*found, *further]


class MetersView(QWidget):
    """The meters, one below the other: a bar up to the limit, a line at the peak, a triangle at the planned value."""

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
        """Draw in colour while values arrive, in grey otherwise."""
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
        """Show the numbers of the meter at the pointer."""
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
