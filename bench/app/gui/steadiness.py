"""Steadiness of each sensor.

The criterion is that of the run, applied to traces instead of samples. The run evaluates all sensors together; here
each sensor is evaluated separately, which shows the sensors that are not yet steady.
"""

from math import isfinite, tau

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from bench.analysis.cycles import fit_cycle
from bench.analysis.signals import MEASURED_BY
from bench.analysis.steady import SPREAD, WINDOW, Steadiness, SteadyDetector
from bench.app.display import texts
from bench.app.gui.widgets import ElidingLabel, set_level
from bench.app.ipc.messages import TRACES, Run, Traces

NEEDED = 2 * WINDOW
"""Number of cycles before the first verdict."""
HARMONICS = 3
"""Number of fitted harmonics: enough for the fundamental and the peak of a trace with a few hundred bins per cycle."""

SENSORS = MEASURED_BY
"""Signals as measured by the sensors. u1 and drift, which are small differences between these signals, are unsuitable:
the clock error of a laser changes their amplitude, whereas it only shifts the phase of the laser's signal.
"""
LASERS = (2, 3)

ACCELERATION, DISPLACEMENT, U1, U2 = (TRACES.index(name) for name in ("acceleration", "displacement", "u1", "u2"))


class SensorSteadiness:
    """Cuts traces into cycles of `omega` [rad/s] and evaluates each of `SENSORS` separately. `tolerance` [1] and
    `jitter` [rad] are those of `bench.analysis.steady.SteadyDetector`; with `beside_table`, the lasers are mounted on
    the ground and therefore also measure the table's displacement.
    """

    def __init__(self, omega: float, tolerance: float, jitter: float, *, beside_table: bool) -> None:
        self._omega, self._tolerance, self._relative = omega, tolerance, beside_table
        self._detectors = [
            SteadyDetector(tolerance, [place], jitter=jitter, reference=LASERS if place in LASERS else ())
            for place in range(len(SENSORS))
        ]
        self._time = np.zeros(0)
        self._values = np.zeros((0, len(SENSORS)))
        self._run = 0
        self.cycles = 0
        """Number of cycles evaluated since the last interruption."""

    def add(self, traces: Traces) -> None:
        """Add a block; a gap discards the cycles before it."""
        time = traces.begin + traces.step * (np.arange(len(traces.low), dtype=np.float64) + 0.5)
        gap = self._time.size > 0 and abs(float(time[0] - self._time[-1]) - traces.step) > traces.step
        if traces.run != self._run or gap:
            self._restart(traces.run)
        self._time, self._values = np.append(self._time, time), np.append(self._values, self._measured(traces), axis=0)
        period = tau / self._omega
        while float(self._time[-1] - self._time[0]) >= period:
            n = int(np.searchsorted(self._time, float(self._time[0]) + period))
            self._judge(self._omega * self._time[:n], self._values[:n])
            self._time, self._values = self._time[n:], self._values[n:]

    def judge(self) -> list[Steadiness]:
        return [detector.judge() for detector in self._detectors]

    def alternates(self, found: Steadiness) -> bool:
        """Whether unequal cycles form a repeating pattern; a slow change from cycle to cycle is not such a pattern."""
        return found.repeats > 1 and found.spread > SPREAD * self._tolerance

    def _measured(self, traces: Traces) -> NDArray[np.float64]:
        """Midpoints of the bins as measured by the sensors, shape (n, len(SENSORS))."""
        middle = 0.5 * (traces.low.astype(np.float64) + traces.high)
        seen = middle[:, [ACCELERATION, DISPLACEMENT, U1, U2]]
        if self._relative:
            seen[:, LASERS] += middle[:, [DISPLACEMENT]]
        return seen

    def _judge(self, phase: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        cycle = fit_cycle(self.cycles, phase, values, HARMONICS)
        if cycle is not None:
            self.cycles += 1
            for detector in self._detectors:
                detector.push(cycle)

    def _restart(self, run: int) -> None:
        self._run, self.cycles = run, 0
        self._time, self._values = self._time[:0], self._values[:0]
        for detector in self._detectors:
            detector.restart()


MARKS = {"steady": "●", "settling": "◐", "repeats": "◆", "gathering": "○"}


class SteadyView(QWidget):
    """Steadiness of the sensors; hidden in protocols without a steady sine."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(texts.NAMES["steady"])
        self._run: Run | None = None
        self._of: tuple[float, float | None] | None = None
        self._judged: SensorSteadiness | None = None
        self._shown = -1
        self.labels = {name: ElidingLabel() for name in SENSORS}
        grid = QGridLayout(self)
        grid.setContentsMargins(4, 0, 0, 0)
        grid.setSpacing(0)
        for place, label in enumerate(self.labels.values()):
            grid.addWidget(label, place, 0)
        self.hide()

    def begin(self, run: Run) -> None:
        """Prepare for a new run; a run without the parameter `settle_tolerance` has no steady sines."""
        tolerance = _tolerance(run)
        self._run, self._of, self._judged = run if tolerance else None, None, None
        if tolerance:
            self.setToolTip(texts.STEADY_TIP.format(window=WINDOW, tolerance=100.0 * tolerance))
        self.hide()

    def point(self, omega: float, beta: float | None) -> None:
        """Set the current sine; a different one discards the earlier cycles."""
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

    def finish(self) -> None:
        """End the current sine."""
        self._of, self._judged = None, None
        self.hide()

    def add(self, traces: list[Traces]) -> None:
        """Add blocks of traces."""
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
    label.setText(f"{MARKS[kind]} {called}: {said}")
    set_level(label, {"steady": "good", "gathering": "calm"}.get(kind, "wait"))


def _change(found: Steadiness) -> str:
    """Text of the relative difference between the means of the two windows, in excess of the noise, in per cent."""
    change = 100.0 * found.drift
    return texts.CHANGE.format(change=change) if change >= 0.01 else texts.NO_CHANGE
