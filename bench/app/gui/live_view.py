"""The live view of the Run page: the parts that the protocol declares, side by side."""

from math import inf
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from bench.app.display.figure import live_view
from bench.app.display.theme import Theme
from bench.app.gui.check_table import CheckTable
from bench.app.gui.gain_plot import GainPlot
from bench.app.gui.live_plot import LivePlot
from bench.app.ipc.messages import Run
from bench.datafile.tables import Table
from bench.events import Event, PointFinished, StepStarted
from bench.live_values import Estimate, RunningGain
from bench.live_view import Checklist, GainCurve, LiveRun, Panel
from bench.protocol import Protocol
from drivers.clock import now

INTERVAL = 0.5
"""Shortest time between two drawings of the panels [s]; drawing two panels takes about a tenth of it."""


class LiveViewArea(QWidget):
    """The view that the protocol's function returns. `draw` redraws it after a change; it is not called while the page
    is hidden.
    """

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._protocol: Protocol[Any] | None = None
        self._run: LiveRun | None = None
        self._running: Estimate | RunningGain | None = None
        self._changed, self._shown_at = False, -inf
        self.gains, self.checks = GainPlot(theme), CheckTable(theme)
        self.plots: list[LivePlot] = []
        """Plots for the panels; those that the present view does not need are hidden."""
        self.parts = QSplitter(Qt.Orientation.Horizontal)
        self.parts.setChildrenCollapsible(False)
        for part in (self.gains, self.checks):
            self.parts.addWidget(part)
        self.checks.hide()
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.parts)

    def use_theme(self, theme: Theme) -> None:
        """Use the colours of another theme."""
        self._theme = theme
        for part in (self.gains, self.checks, *self.plots):
            part.use_theme(theme)

    @property
    def shown(self) -> list[LivePlot]:
        """The plots of the present view."""
        return [plot for plot in self.plots if not plot.isHidden()]

    def predict(self, prediction: Table) -> None:
        """Show the predicted gains of the next run."""
        self.gains.predict(prediction)

    def begin(self, protocol: Protocol[Any], run: Run) -> None:
        """Replace the view of the last run by that of a new run."""
        self._protocol, self._running = protocol, None
        self._run = LiveRun(protocol.point, run.parameters, run.configuration)
        self._show()
        self._shown_at = -inf

    def open(self, prediction: Table) -> None:
        """Set the prediction of the run."""
        if self._run is not None:
            self._run.prediction, self._changed = prediction, True

    def follow(self, event: Event) -> None:
        """Update the view with an event of the run."""
        if isinstance(event, Estimate | RunningGain):
            self._running = event
        elif self._run is not None and self._run.follow(event):
            self._changed = True
        if isinstance(event, StepStarted):
            self.end_step()
        if isinstance(event, PointFinished):
            self._running = None
            self.gains.add(event.point.model_dump())

    def end_step(self) -> None:
        """Remove the running gain of a step that has ended."""
        self._running = None
        self.gains.hide_running()

    def draw(self) -> None:
        """Draw the changes since the last call; the panels are drawn at most once in `INTERVAL`."""
        if self._running is not None and not self.gains.isHidden():
            self.gains.show_running(self._running)
            self._running = None
        if self._changed and now() - self._shown_at >= INTERVAL:
            self._show()

    def _show(self) -> None:
        self._changed, self._shown_at = False, now()
        if self._protocol is None or self._run is None:
            return
        view = live_view(self._protocol, self._run)
        panels = [part for part in view if isinstance(part, Panel)]
        while len(self.plots) < len(panels):
            self.plots.append(LivePlot(self._theme))
            self.parts.addWidget(self.plots[-1])
        for number, plot in enumerate(self.plots):
            plot.setVisible(number < len(panels))
            if number < len(panels):
                plot.show_panel(panels[number])
        self.gains.setVisible(any(isinstance(part, GainCurve) for part in view))
        checklists = [part for part in view if isinstance(part, Checklist)]
        self.checks.setVisible(bool(checklists))
        for checklist in checklists:
            self.checks.show_checks(checklist)
