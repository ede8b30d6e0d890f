"""From a dwell that has just begun to a measured steady state: hold the amplitude, wait, measure."""

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle, mean_amplitude
from bench.analysis.gain import SensorAccuracy, SteadyPeak, modulated_peak, steady_peak
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.steady import WINDOW, Steadiness, SteadyDetector
from bench.engine.steps import Dwell, Fallen, Measured, Outcome, Step, Trim
from protocols.harmonic.evidence import need_cycles
from protocols.harmonic.parameters import HarmonicParameters

TURN = 6
"""Cycles between two looks at amplitude and steadiness."""

LARGEST_TRIM = 0.10
"""Largest relative change of the drive at one look."""

TRIM_GAIN = 0.7
"""Share of an amplitude error that one trim removes: below 1 because the block's reaction lags by many cycles."""


@dataclass(frozen=True)
class Settled:
    """What a dwell came to: its peak, how steady it was, how long that took, and how far off the amplitude is."""

    peak: SteadyPeak
    steadiness: Steadiness
    time: float
    amplitude_error: float


JUDGED = (ACCELERATION, DISPLACEMENT, LASER_1, LASER_2)
"""Signals on which the steady state is judged: as the sensors see them, since the jitter of a laser's delay moves only
their phase, but moves u1 and drift, which are small differences, in size as well."""

KIN = (2, 3)
"""Places of the lasers among them."""

SHORTEST = 10.0
"""Shortest wait [s]: at high frequencies two windows of cycles are shorter than the frame's memory."""

LEFT = 1.2
"""Tolerances that a transient may still have to go when the detector is content (see `SteadyDetector`)."""

Look = Callable[[list[Cycle]], Generator[Step, Outcome, None]]
"""What is told to the operator at each look: steps made from the cycles of the last window."""


def settle_and_measure(
    omega: float, amplitude: float, parameters: HarmonicParameters, accuracy: SensorAccuracy, look: Look
) -> Generator[Step, Outcome, Settled | Fallen]:
    """Hold `amplitude` [m/s2] at `omega` [rad/s] until every signal is steady, then measure.

    A motion that does not become steady within the settle limit is measured as it is: as a modulated one.
    """
    detector = SteadyDetector(parameters.settle_tolerance, JUDGED, KIN, omega * accuracy.laser_timing)
    recent: deque[Cycle] = deque(maxlen=WINDOW)
    measured = max(parameters.measured_cycles, 2 * WINDOW)
    waited, over = 0.0, False
    while True:
        ready = over or (waited >= SHORTEST and detector.judge().steady)
        asked = measured if ready else TURN
        outcome = yield Dwell(asked)
        if not isinstance(outcome, Measured):
            return Fallen()
        waited += asked * tau / omega
        need_cycles(outcome.cycles, asked)
        for cycle in outcome.cycles:
            detector.push(cycle)
        if ready:
            # the verdict is on the cycles that are used; at the tolerance itself noise would decide, hence twice
            steadiness = detector.judge(allowance=2.0)
            if steadiness.steady or over:
                used = outcome.cycles[-parameters.measured_cycles :]
                return _settled(used, steadiness, waited, amplitude, parameters)
        recent.extend(outcome.cycles)
        yield from look(list(recent))
        over = waited >= parameters.settle_limit
        error = mean_amplitude(outcome.cycles, ACCELERATION) / amplitude - 1.0
        if abs(error) > parameters.amplitude_tolerance and not over:
            correction = float(np.clip(-TRIM_GAIN * error, -LARGEST_TRIM, LARGEST_TRIM))
            yield Trim(1.0 + correction)
            detector.restart()


def _settled(
    cycles: tuple[Cycle, ...], steadiness: Steadiness, waited: float, amplitude: float, parameters: HarmonicParameters
) -> Settled:
    peak = steady_peak(cycles, LEFT * parameters.settle_tolerance) if steadiness.steady else modulated_peak(cycles)
    return Settled(peak, steadiness, waited, peak.amplitude / amplitude - 1.0)
