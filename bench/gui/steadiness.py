"""Which sensor has become steady. Knows nothing of Qt.

The same signals and the same criterion as the run's, on traces instead of samples: the run judges all its sensors
together and decides; this tells a person which of them it waits for.
"""

from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import fit_cycle
from bench.analysis.signals import MEASURED_BY
from bench.analysis.steady import SPREAD, WINDOW, Steadiness, SteadyDetector
from bench.link.messages import Traces
from bench.link.reduction import TRACES

NEEDED = 2 * WINDOW
"""Cycles before anything can be said."""
HARMONICS = 3
"""Harmonics that are fitted: enough for the fundamental and the peak of a trace with a few hundred bins a cycle."""

SENSORS = MEASURED_BY
"""What is judged: as the sensors see it. u1 and drift are small differences of these, and a laser that runs on its own
clock moves them in size where it moves itself only in phase."""
LASERS = (2, 3)

ACCELERATION, DISPLACEMENT, U1, U2 = (TRACES.index(name) for name in ("acceleration", "displacement", "u1", "u2"))


class SensorSteadiness:
    """Cuts traces into cycles of `omega` [rad/s] and judges each of `SENSORS` by itself.

    `tolerance` [1] and `jitter` [rad] are those of `bench.analysis.steady.SteadyDetector`; with `beside_table` the
    lasers stand on the ground and see the table's displacement too.
    """

    def __init__(self, omega: float, tolerance: float, jitter: float, *, beside_table: bool) -> None:
        self._omega, self._tolerance, self._beside_table = omega, tolerance, beside_table
        self._detectors = [
            SteadyDetector(tolerance, [place], jitter=jitter, beside=LASERS if place in LASERS else ())
            for place in range(len(SENSORS))
        ]
        self._time = np.zeros(0)
        self._values = np.zeros((0, len(SENSORS)))
        self._run = 0
        self.cycles = 0
        """Cycles that were judged since the last interruption."""

    def add(self, traces: Traces) -> None:
        """Take the next block; one that does not follow the last begins anew."""
        time = traces.begin + traces.step * (np.arange(len(traces.low), dtype=np.float64) + 0.5)
        gap = self._time.size > 0 and abs(float(time[0] - self._time[-1]) - traces.step) > traces.step
        if traces.run != self._run or gap:
            self._restart(traces.run)
        self._time, self._values = np.append(self._time, time), np.append(self._values, self._seen(traces), axis=0)
        period = tau / self._omega
        while float(self._time[-1] - self._time[0]) >= period:
            n = int(np.searchsorted(self._time, float(self._time[0]) + period))
            self._judge(self._omega * self._time[:n], self._values[:n])
            self._time, self._values = self._time[n:], self._values[n:]

    def judge(self) -> list[Steadiness]:
        """Where each sensor stands."""
        return [detector.judge() for detector in self._detectors]

    def alternates(self, found: Steadiness) -> bool:
        """Whether cycles differ from one another and repeat: no slow change that is small from one to the next."""
        return found.repeats > 1 and found.spread > SPREAD * self._tolerance

    def _seen(self, traces: Traces) -> NDArray[np.float64]:
        """The middles of the bins as the sensors see them, shape (n, len(SENSORS))."""
        middle = 0.5 * (traces.low.astype(np.float64) + traces.high)
        seen = middle[:, [ACCELERATION, DISPLACEMENT, U1, U2]]
        if self._beside_table:
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
