"""From a dwell that has just begun to a measured steady state: hold the sine, wait, measure."""

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from math import tau

from bench.analysis.cycles import Cycle
from bench.analysis.gain import SensorAccuracy, SteadyPeak, modulated_peak, steady_peak
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.steady import WINDOW, Steadiness, SteadyDetector
from bench.control.answer import Answer, Sine
from bench.control.sine import SineControl, Tolerance
from bench.engine.steps import Dwell, Fallen, Measured, Outcome, Step, Trim
from protocols.common.calibrate import need_cycles
from protocols.harmonic.protocol import HarmonicParameters

TURN = 6
"""Cycles between two looks at the table's motion and at steadiness."""

TURNING = 2
"""First cycles of a look, in which the table goes to what it was last told: they say nothing of how well it does."""

AIM = 0.5
"""Share of the tolerances that is aimed at: a block that has not settled yet still moves the table by the rest."""


@dataclass(frozen=True)
class Settled:
    """What a dwell came to: its peak, how steady it was, and how long that took [s].

    `amplitude_error` (relative) and `phase_error` [rad] are the table's, after `updates` corrections of its drive.
    """

    peak: SteadyPeak
    steadiness: Steadiness
    time: float
    amplitude_error: float
    phase_error: float
    updates: int


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
    sine: Sine, parameters: HarmonicParameters, accuracy: SensorAccuracy, look: Look
) -> Generator[Step, Outcome, Settled | Fallen]:
    """Hold the table at `sine` until every signal is steady, then measure.

    A motion that does not become steady within the settle limit is measured as it is: as a modulated one.
    """
    detector = SteadyDetector(parameters.settle_tolerance, JUDGED, KIN, sine.omega * accuracy.laser_timing)
    control = SineControl(
        parameters.harmonics,
        Tolerance(
            AIM * parameters.amplitude_tolerance,
            AIM * parameters.phase_tolerance,
            AIM * parameters.distortion_tolerance,
        ),
    )
    turn: complex | None = None
    updates = 0
    recent: deque[Cycle] = deque(maxlen=WINDOW)
    measured = max(parameters.measured_cycles, 2 * WINDOW)
    waited, over = 0.0, False
    while True:
        ready = over or (waited >= SHORTEST and detector.judge().steady)
        asked = measured if ready else TURN
        outcome = yield Dwell(asked)
        if not isinstance(outcome, Measured):
            return Fallen()
        waited += asked * tau / sine.omega
        need_cycles(outcome.cycles, asked)
        turn = sine.turn(outcome.cycles[0]) if turn is None else turn
        for cycle in outcome.cycles:
            detector.push(cycle)
        if ready:
            # the verdict is on the cycles that are used; at the tolerance itself noise would decide, hence twice
            steadiness = detector.judge(allowance=2.0)
            if steadiness.steady or over:
                used = outcome.cycles[-parameters.measured_cycles :]
                table = Answer.of(used, sine, turn)
                peak = _peak(used, sine.omega, steadiness, parameters)
                return Settled(peak, steadiness, waited, table.amplitude_error, table.phase_error, updates)
        recent.extend(outcome.cycles)
        yield from look(list(recent))
        over = waited >= parameters.settle_limit
        shares = control.next(Answer.of(outcome.cycles[TURNING:], sine, turn))
        if shares is not None and not over:
            yield Trim(shares)
            updates += 1
            detector.restart()


def _peak(
    cycles: tuple[Cycle, ...], omega: float, steadiness: Steadiness, parameters: HarmonicParameters
) -> SteadyPeak:
    if steadiness.steady:
        return steady_peak(cycles, omega, LEFT * parameters.settle_tolerance)
    return modulated_peak(cycles, omega)
