"""From a dwell that has just begun to a measured steady state: hold the amplitude, wait, measure."""

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle
from bench.analysis.gain import SteadyPeak, modulated_peak, steady_peak
from bench.analysis.signals import ACCELERATION, DRIFT, U1
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
    """What a dwell came to: its peak, how steady it was, and how long it took to become so."""

    peak: SteadyPeak
    steadiness: Steadiness
    time: float


Look = Callable[[list[Cycle]], Generator[Step, Outcome, None]]
"""What is told to the operator at each look: steps made from the cycles of the last window."""


def settle_and_measure(
    omega: float, amplitude: float, parameters: HarmonicParameters, look: Look
) -> Generator[Step, Outcome, Settled | Fallen]:
    """Hold `amplitude` [m/s2] at `omega` [rad/s] until every signal is steady, then measure.

    A motion that does not become steady within the settle limit is measured as it is: as a modulated one.
    """
    detector = SteadyDetector(parameters.settle_tolerance, kin=(U1, DRIFT))
    recent: deque[Cycle] = deque(maxlen=WINDOW)
    waited = 0.0
    steadiness = detector.judge()
    while waited < parameters.settle_limit:
        outcome = yield Dwell(TURN)
        if not isinstance(outcome, Measured):
            return Fallen()
        waited += TURN * tau / omega
        need_cycles(outcome.cycles, TURN)
        for cycle in outcome.cycles:
            detector.push(cycle)
        recent.extend(outcome.cycles)
        yield from look(list(recent))
        steadiness = detector.judge()
        error = achieved(outcome.cycles) / amplitude - 1.0
        if abs(error) > parameters.amplitude_tolerance:
            correction = float(np.clip(-TRIM_GAIN * error, -LARGEST_TRIM, LARGEST_TRIM))
            yield Trim(1.0 + correction)
        elif steadiness.steady:
            break
    outcome = yield Dwell(parameters.measured_cycles)
    if not isinstance(outcome, Measured):
        return Fallen()
    need_cycles(outcome.cycles, parameters.measured_cycles)
    peak = (steady_peak if steadiness.steady else modulated_peak)(outcome.cycles)
    return Settled(peak, steadiness, waited)


def achieved(cycles: tuple[Cycle, ...]) -> float:
    """Mean amplitude of the table's acceleration over cycles [m/s2]."""
    return float(np.mean([abs(cycle.fundamental[ACCELERATION]) for cycle in cycles]))
