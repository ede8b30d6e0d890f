"""Demands of the stages of a sine test, simulated with specimens drawn within their uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment, program
from bench.control.starts import CATCH_ANGLE, DRIVE, SEED, Start
from bench.preflight.demands import (
    UNKNOWN_SHAKER,
    StageDemands,
    TableResponse,
    Travel,
    demand,
    load,
    response_of,
    stage_travels,
)
from bench.preflight.margins import Demand, Stage, bounds
from bench.progress import Progress, counting, silent
from bench.result_cache import cached
from protocols.common.calibrate import CHANGE_TIME, MEASURED, PROBE, SETTLING, harmonic_frequencies
from protocols.common.sine.calibration import resting_calibration
from protocols.common.sine.holding import SLOW
from protocols.common.sine.settings import SineParameters
from sim.channel import STOREYS
from sim.gain import predict_gain
from sim.specimen import Specimen
from sim.sweep import Done, in_threads

HOLD, BARE_HOLD = 20.0, 40.0
"""Simulated durations of a stage's last sine, with the block and with the bare frame [s]."""

PROBES = (PROBE, 10.0 * PROBE)
"""Amplitudes [V] of the probes of an unknown table."""


Array = NDArray[np.float64]

DRAWS = 16
"""Number of specimens drawn in addition to the nominal one; the 95 % quantile of the draws is close to their
maximum.
"""

RIPPLE = 0.03
"""Relative allowance, in the demands on table and drive, for noise and for the effects of friction that a calibration
at a lower level does not detect.
"""

IMPACTS = 0.15
"""Relative allowance for the impacts of a rocking block, which increase some demands until the table's harmonics are
cancelled.
"""

OFF_MIDDLE = 0.015
"""Assumed largest offset of a storey at rest from the middle of the laser's range, relative to half the range."""

_RAISED = ("acceleration", "force", "current", "drive_slew")
"""Quantities increased by impacts."""

_UNKNOWN = {
    "drive_voltage": "the table is unknown: specify table_model",
    "drive_slew": "the table is unknown: specify table_model",
    **UNKNOWN_SHAKER,
}


@dataclass(frozen=True)
class Trial:
    """A simulated stage: the segments `before` it, which are not evaluated, the stage itself, and its last sine, which
    is continued.

    The last sine is simulated for `hold` [s] and may last `longest` [s] on the bench. `beta` is the stiffness ratio
    with which the block rocks, None if it rests. `steady` is the frequency [rad/s] whose steady state is also
    evaluated. `control` is the largest control of a motion that is held on its orbit after the stage, relative to the
    amplitude.
    """

    stage: Stage
    specimen: Specimen
    before: tuple[Segment, ...] = ()
    hold: float = 0.0
    longest: float = 0.0
    beta: float | None = None
    steady: float | None = None
    control: float = 0.0

    @property
    def segments(self) -> tuple[Segment, ...]:
        """All simulated segments."""
        segments = (*self.before, *self.stage.segments)
        return (*segments, replace(segments[-1], duration=self.hold)) if self.hold > 0.0 else segments

    @property
    def begin(self) -> float:
        """Start of the evaluation, from the start of the simulation [s]."""
        return sum(segment.duration for segment in self.before)


def spring_calibration_trial(
    specimen: Specimen, omegas: Sequence[float], starts: Sequence[Start], level: float
) -> Trial:
    """Trial of the drive calibration with the coupled frame and the block at rest, at most at `level` [m/s2]."""
    wanted, allowed = resting_calibration(specimen, omegas, starts, level)
    segments = calibration_segments([(omega, allowed) for omega in wanted])
    return Trial(Stage(f"calibration of the drive with beta = {specimen.label:g}", segments), specimen)


def bare_calibration_trial(
    parameters: SineParameters,
    omegas: Sequence[float],
    amplitude: float,
    specimen: Specimen,
    response: TableResponse | None,
) -> Trial:
    """Trial of the drive calibration with the bare frame, for tests at `amplitude` [m/s2].

    Each drive is computed from the response at the previous frequency, the first one from the response to the probe.
    Friction considerably reduces the response to a small probe, so the first drive moves the table more than intended.
    """
    level = parameters.calibration_level * amplitude
    first = omegas[0]
    wanted = sorted({*omegas, *harmonic_frequencies(max(omegas), parameters.harmonics)})
    segments: list[Segment] = []
    if response is None:
        levels = [(omega, level) for omega in wanted]
    else:
        gains = response.gain(np.array([first, *wanted]), specimen.bare().mass)
        for volts in PROBES:
            segments += [*_measured(first, volts * float(gains[0])), Segment(CHANGE_TIME, 0.0, first)]
        probed = gains[0] * (1.0 - response.friction / PROBES[-1])
        before = [probed, *gains[1:-1]]
        levels = [(w, level * float(gain / by)) for w, gain, by in zip(wanted, gains[1:], before, strict=True)]
    for omega, moved in levels:
        segments += [*_measured(omega, moved), Segment(CHANGE_TIME, 0.0, omega)]
    segments.append(Segment(CHANGE_TIME, 0.0, wanted[-1]))
    return Trial(Stage("calibration of the drive with the bare frame", tuple(segments)), specimen.bare())


def calibration_segments(levels: Sequence[tuple[float, float]]) -> tuple[Segment, ...]:
    """Segments of a calibration through all pairs of frequency [rad/s] and level [m/s2], ending at zero level."""
    segments = [segment for omega, level in levels for segment in _measured(omega, level)]
    return (*segments, Segment(CHANGE_TIME, 0.0, levels[-1][0]))


def _measured(omega: float, level: float) -> tuple[Segment, Segment]:
    return Segment(CHANGE_TIME, level, omega), Segment((SETTLING + MEASURED) * tau / omega, level, omega)


def slow(specimen: Specimen, omega: float, amplitude: float) -> bool:
    """Whether the rocking orbit at `omega` [rad/s] and `amplitude` [m/s2] is expected to need a hold, because
    disturbances of it grow or hardly decay.
    """
    branch = predict_gain(specimen, omega, amplitude).rocking
    return branch is not None and branch.multiplier > SLOW


def demands_of(
    found: Sequence[Trial],
    configuration: BenchConfiguration,
    steady: Callable[[float | None, float], Travel | None] | None = None,
    progress: Progress = silent,
) -> tuple[Demand, ...]:
    """Demands of all trials.

    `steady`, if given, returns the steady motion at a stiffness ratio and a frequency [rad/s], which is evaluated as
    well. Each drawn specimen and its drive error are used for all stages. Raises InvalidInput for a table model that
    cannot be read or does not cover the frequencies.
    """
    response = response_of(configuration)
    factors = np.concatenate(([1.0], 1.0 + DRIVE * np.random.default_rng(SEED).uniform(-1.0, 1.0, DRAWS)))
    simulating = counting(progress, f"simulating every stage with {1 + DRAWS} specimens")
    moved = _travels(found, factors, configuration, simulating)
    asked = [
        _trial_demands(
            trial,
            travels,
            None if steady is None or trial.steady is None else steady(trial.beta, trial.steady),
            factors,
            configuration,
            response,
        )
        for trial, travels in zip(found, moved, strict=True)
    ]
    return tuple(demand(quantity, asked, _UNKNOWN) for quantity in bounds(configuration))


def _travels(
    found: Sequence[Trial], factors: Array, configuration: BenchConfiguration, done: Done
) -> list[list[Travel]]:
    """Motions of the nominal and of the drawn specimens in each trial, computed on all processors."""
    drawn: dict[Specimen, list[Specimen]] = {}
    for trial in found:
        if trial.specimen not in drawn:
            others = configuration.known.draws(trial.specimen, DRAWS, np.random.default_rng(SEED))
            drawn[trial.specimen] = [trial.specimen, *others]
    reference = configuration.laser_reference
    models = {specimen: [each.model_dump(mode="json") for each in drawn[specimen]] for specimen in drawn}

    def one(trial: Trial) -> list[Travel]:
        def simulated() -> list[list[float]]:
            programs = [program(segments) for segments in driven]
            moved = stage_travels(drawn[trial.specimen], programs, trial.begin, reference, CATCH_ANGLE)
            return [[*astuple(each)] for each in moved]

        driven = [
            [replace(segment, amplitude=float(factor) * segment.amplitude) for segment in trial.segments]
            for factor in factors
        ]
        segments = [[astuple(segment) for segment in each] for each in driven]
        inputs = [models[trial.specimen], segments, trial.begin, reference, CATCH_ANGLE]
        return [Travel(*each) for each in cached("travel", inputs, simulated)]

    return in_threads(one, found, done)


def _trial_demands(
    trial: Trial,
    travels: Sequence[Travel],
    steady: Travel | None,
    factors: Array,
    configuration: BenchConfiguration,
    response: TableResponse | None,
) -> StageDemands:
    loads = load(
        program(trial.segments),
        trial.begin,
        trial.longest,
        payload=trial.specimen.mass,
        shaker=configuration.shaker_model,
        response=response,
        heating_time=configuration.limits.heating_time,
    )
    raised = _RAISED if trial.beta is not None else ()
    values = {
        quantity: factors * value * (1.0 + (IMPACTS if quantity in raised else RIPPLE))
        for quantity, value in loads.items()
    }
    values = {quantity: (1.0 + trial.control) * value for quantity, value in values.items()}
    # a simulation of limited duration may not reach the steady state
    steady = steady or Travel(0.0, 0.0, 0.0)
    halves = configuration.laser_half_ranges
    storeys = [
        np.array([max(getattr(each, name), getattr(steady, name)) for each in travels]) * (1.0 + trial.control)
        for name in ("storey_1", "storey_2", "drift")
    ]
    values |= {
        STOREYS[0]: storeys[0] / halves[0] + OFF_MIDDLE,
        STOREYS[1]: storeys[1] / halves[1] + OFF_MIDDLE,
        "drift": storeys[2],
    }
    return StageDemands(trial.stage.name, values)
