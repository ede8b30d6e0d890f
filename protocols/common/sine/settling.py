"""Detection and measurement of the steady state of a dwell."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, replace
from math import tau

from bench.analysis.cycles import Cycle
from bench.analysis.free_motion import KEPT, FreeMotion, Rate, free_motion, orbit_peak
from bench.analysis.gain import SensorAccuracy, SteadyPeak, steady_peak
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.steady import WINDOW, Steadiness, SteadyDetector
from bench.config.model import BenchConfiguration
from bench.control.sine import Sine, SineControl, SineResponse, Tolerance
from bench.engine.steps import Dwell, Fallen, Measured, Outcome, SetHarmonics, Step
from protocols.common.calibrate import complete_cycles
from protocols.common.sine.settings import SineParameters

INTERVAL = 6
"""Number of cycles between checks of the table's motion and of steadiness."""

TRANSIENT = 2
"""Number of cycles discarded at the start of an interval, while the preceding correction of the drive takes effect."""

AIM = 0.5
"""Fraction of the tolerances to which the table is corrected; the rest allows for disturbances by a block that has not
settled.
"""


@dataclass(frozen=True)
class TableState:
    """Sine of the table at the end of a dwell: its `turn` (see `Sine.turn`), the harmonics of its drive as `shares` of
    the commanded amplitude, and `answer`, the ratio of the achieved fundamental to that in the drive.
    """

    turn: complex
    shares: tuple[complex, ...]
    answer: complex


@dataclass(frozen=True)
class Settled:
    """A measured dwell: its peak, its steadiness, and its settling `time` [s]. `amplitude_error` (relative) and
    `phase_error` [rad] are errors of the table, after `updates` corrections of its drive. `motion` describes an
    unsteady motion; if that revolves about a periodic motion, `orbit` is the peak of its mean cycle. `table` is the
    state of the table at the end of the dwell, None if unknown.
    """

    peak: SteadyPeak
    steadiness: Steadiness
    time: float
    amplitude_error: float
    phase_error: float
    updates: int
    motion: FreeMotion | None = None
    orbit: SteadyPeak | None = None
    table: TableState | None = None


@dataclass(frozen=True)
class Held:
    """Result of a hold: the peak of the held motion, and the errors of the table as in `Settled`.

    `control` is the rms of the control over the measured cycles, as a share of the amplitude, and `captured` the number
    of cycles until the capture. `peak` is None if the hold was released, for the stated `reason`. `rate` is the rate of
    change of the deviation without control, after the measurement, during which the block may have `fallen`.
    `model_free` tells whether the stabiliser's map was identified in the run.
    """

    peak: SteadyPeak | None
    reason: str = ""
    amplitude_error: float = 0.0
    phase_error: float = 0.0
    updates: int = 0
    control: float = 0.0
    captured: int | None = None
    cycles: int = 0
    rate: Rate | None = None
    fallen: bool = False
    model_free: bool = False


JUDGED = (ACCELERATION, DISPLACEMENT, LASER_1, LASER_2)
"""Signals of the steadiness criterion. These are the sensors' signals, since the jitter of a laser's delay affects only
their phases, whereas it affects the amplitudes of u1 and drift, which are small differences.
"""

LASERS = (2, 3)
"""Indices of the lasers in `JUDGED`."""

SHORTEST = 10.0
"""Shortest wait for steadiness [s]; two windows of cycles may be shorter than the frame's transient."""

PRECEDING = 96
"""Largest number of cycles before the measured ones from which the remaining transient is estimated."""

MOST = 6
"""Largest number of measurements of a steady motion of which each had a remaining transient worth a longer wait."""

Report = Callable[[list[Cycle]], Generator[Step, Outcome, None]]
"""Callback that publishes the running gain at each check, from the cycles of the last window."""

Waiting = Callable[[SteadyPeak], bool]
"""Callback that tells whether the remaining transient of a measured peak is worth a longer wait."""


def settle_and_measure(
    sine: Sine,
    parameters: SineParameters,
    accuracy: SensorAccuracy,
    report: Report,
    frame: LinearFrame | None = None,
    free_cycles: int = 0,
    waiting: Waiting | None = None,
) -> Generator[Step, Outcome, Settled | Fallen]:
    """Hold the table at `sine` until every signal is steady, then measure.

    A motion that is not steady within the settle limit is measured as modulated. The drive of such a motion is constant
    for the last `free_cycles` cycles before the limit, but at most for half of the limit. In a test of the bare frame,
    its model `frame` is used to check the lasers. A steady motion for whose peak `waiting` holds is measured again, up
    to `MOST` times and until the settle limit.
    """
    detector = SteadyDetector(parameters.settle_tolerance, JUDGED, LASERS, sine.omega * accuracy.laser_timing)
    control = SineControl(
        parameters.harmonics,
        Tolerance(
            AIM * parameters.amplitude_tolerance,
            AIM * parameters.phase_tolerance,
            AIM * parameters.distortion_tolerance,
        ),
    )
    turn: complex | None = None
    updates, drive, measurements = 0, (1.0 + 0.0j,), 0
    recent: deque[Cycle] = deque(maxlen=WINDOW)
    constant: deque[Cycle] = deque(maxlen=KEPT)
    measured = max(parameters.measured_cycles, 2 * WINDOW)
    limit = parameters.settle_limit
    last_correction = max(limit - free_cycles * tau / sine.omega, 0.5 * limit)
    waited, over = 0.0, False
    while True:
        ready = over or (waited >= SHORTEST and detector.judge().steady)
        asked = measured if ready else INTERVAL
        again = False
        outcome = yield Dwell(asked)
        if not isinstance(outcome, Measured):
            return Fallen()
        waited += asked * tau / sine.omega
        cycles = complete_cycles(outcome, asked, settling=0)
        turn = sine.turn(cycles[0]) if turn is None else turn
        for cycle in cycles:
            detector.push(cycle)
        # the first cycles after a correction of the drive are transient
        constant.extend(cycles if constant or not updates else cycles[TRANSIENT:])
        if ready:
            # twice the tolerance is allowed, since at the tolerance itself noise would decide the verdict
            steadiness = detector.judge(allowance=2.0)
            if steadiness.steady or over:
                used = cycles[-parameters.measured_cycles :]
                table = SineResponse.of(used, sine, turn)
                motion = orbit = None
                if steadiness.steady:
                    peak = steady_peak(used, sine.omega, before=preceding(list(constant), used), frame=frame)
                    measurements += 1
                    again = waiting is not None and not over and measurements < MOST and waiting(peak)
                else:
                    kept = list(constant)
                    motion = free_motion(kept, sine.omega, accuracy)
                    peak = motion.peaks.greatest
                    orbit = orbit_peak(kept, motion, sine.omega)
                state = TableState(turn, drive, complex(table.achieved[0] / table.played[0]))
                errors = table.amplitude_error, table.phase_error
                if not again:
                    return Settled(peak, steadiness, waited, *errors, updates, motion, orbit, state)
        recent.extend(cycles)
        yield from report(list(recent))
        over = waited >= limit
        if again:
            continue
        if waited >= last_correction:
            # the same allowance as in the verdict at the limit
            if over or not detector.judge(allowance=2.0).steady:
                continue
            control.take_full_steps()
        shares = control.next(SineResponse.of(cycles[TRANSIENT:], sine, turn))
        if shares is not None:
            yield SetHarmonics(shares)
            drive = shares
            updates += 1
            detector.restart()
            constant.clear()


def linear_frame(configuration: BenchConfiguration) -> LinearFrame:
    """Model of the bare frame, used in its tests to check the lasers."""
    grounded = configuration.laser_reference == "ground"
    return LinearFrame(configuration.known_specimen.bare(), grounded)


def checked(sensors: SensorUncertainty, references: Iterable[Settled]) -> SensorUncertainty:
    """`sensors`, extended by the checks of the lasers' linearity from the steady tests of the bare frame."""
    return replace(sensors, checks=tuple(each.peak.checks for each in references if each.peak.checks is not None))


def preceding(constant: Sequence[Cycle], used: Sequence[Cycle]) -> Sequence[Cycle]:
    """The cycles before the `used` ones, which end the sequence `constant` of cycles at the same drive."""
    return constant[: -len(used)][-PRECEDING:]
