"""Which sensor is steady: a mark, a word and a number for each."""

from math import isfinite

from PySide6.QtWidgets import QHBoxLayout, QLabel, QSizePolicy, QWidget

from bench.analysis.steady import WINDOW, Steadiness
from bench.gui import texts
from bench.gui.header import set_level
from bench.gui.steadiness import NEEDED, SENSORS, SensorSteadiness
from bench.link.messages import Run, Traces

MARKS = {"steady": "●", "settling": "◐", "repeats": "◆", "gathering": "○"}


class SteadyView(QWidget):
    """Hidden where there is no steady sine to wait for."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(texts.NAMES["steady"])
        self._run: Run | None = None
        self._of: tuple[float, float | None] | None = None
        self._judged: SensorSteadiness | None = None
        self._shown = -1
        self.labels = {name: QLabel() for name in SENSORS}
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        for label in self.labels.values():
            label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
            row.addWidget(label, 1)
        self.hide()

    def begin(self, run: Run) -> None:
        """A new run; one without `settle_tolerance` among its parameters has no sines to wait for."""
        tolerance = _tolerance(run)
        self._run, self._of, self._judged = run if tolerance else None, None, None
        if tolerance:
            self.setToolTip(texts.STEADY_TIP.format(window=WINDOW, tolerance=100.0 * tolerance))
        self.hide()

    def point(self, omega: float, beta: float | None) -> None:
        """The sine that is held now: another one is judged anew."""
        if self._run is not None and (omega, beta) != self._of:
            self._of, self._shown = (omega, beta), -1
            configuration = self._run.configuration
            self._judged = SensorSteadiness(
                omega,
                _tolerance(self._run),
                omega * configuration.analysis.laser_timing,
                beside_table=configuration.laser_reference == "ground",
            )
            self.show()

    def over(self) -> None:
        """The sine ends."""
        self._of, self._judged = None, None
        self.hide()

    def add(self, traces: list[Traces]) -> None:
        """Take in blocks."""
        judged = self._judged
        if judged is None:
            return
        for block in traces:
            judged.add(block)
        if judged.cycles != self._shown:
            self._shown = judged.cycles
            for label, called, found in zip(self.labels.values(), texts.SENSORS, judged.judge(), strict=True):
                _show(label, called, found, judged)


def _tolerance(run: Run) -> float:
    return float(getattr(run.parameters, "settle_tolerance", 0.0))


def _show(label: QLabel, called: str, found: Steadiness, judged: SensorSteadiness) -> None:
    if found.steady:
        kind, said = "steady", f"{texts.STEADY}, {_change(found)}"
    elif judged.alternates(found):
        kind, said = "repeats", texts.REPEATS.format(cycles=found.repeats)
    elif isfinite(found.drift):
        kind, said = "settling", f"{texts.SETTLING}, {_change(found)}"
    else:
        kind, said = "gathering", texts.GATHERING.format(done=min(judged.cycles, NEEDED), needed=NEEDED)
    label.setText(f"{MARKS[kind]} {called}\n{said}")
    set_level(label, {"steady": "good", "gathering": "calm"}.get(kind, "wait"))


def _change(found: Steadiness) -> str:
    """How far the means of the two windows are apart, beyond what noise explains."""
    change = 100.0 * found.drift
    return texts.CHANGE.format(change=change) if change >= 0.01 else texts.NO_CHANGE
