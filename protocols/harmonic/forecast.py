"""Stages of a harmonic campaign, and their demands within the specimen's uncertainty."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import tau

from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment
from bench.control.starts import Start
from bench.preflight.demands import TableResponse, Travel, response_of
from bench.preflight.margins import Forecast, Stage
from bench.progress import Progress, silent
from protocols.common.sine.demands import (
    BARE_HOLD,
    HOLD,
    Trial,
    bare_calibration_trial,
    demands_of,
    slow,
    spring_calibration_trial,
)
from protocols.common.sine.holding import MODEL_FREE_PATIENCE, PATIENCE, too_late
from protocols.common.sine.pace import Pace
from protocols.harmonic.approach import stable_above, with_pause
from protocols.harmonic.plan import BARE_CHANGE
from protocols.harmonic.protocol import HarmonicParameters
from sim.specimen import Specimen


def trials(
    parameters: HarmonicParameters,
    configuration: BenchConfiguration,
    response: TableResponse | None,
    starts: Mapping[tuple[float, float], Sequence[Start]],
) -> Iterator[Trial]:
    """Every stage that the plan may reach; `starts` are the planned starts by stiffness ratio and frequency [rad/s].

    Without a `response` of the table, the calibration of the bare frame is assumed to reach its level exactly.
    """
    specimen = configuration.known_specimen
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    yield bare_calibration_trial(parameters, parameters.omega, amplitude, specimen, response)
    yield from _bare_tests(parameters, specimen)
    longest = _longest_dwell(parameters)
    for beta in parameters.beta:
        coupled = specimen.coupled(beta)
        plans = {omega: starts[beta, omega] for omega in parameters.omega}
        planned = [start for each in plans.values() for start in each]
        yield spring_calibration_trial(coupled, parameters.omega, planned, parameters.calibration_level * amplitude)
        for omega, planned in plans.items():
            possible = parameters.hold and too_late(configuration, omega) is None
            held = possible and slow(coupled, omega, amplitude)
            patience = PATIENCE + (MODEL_FREE_PATIENCE if parameters.model_free else PATIENCE)
            extra = patience * tau / omega if held else 0.0
            authority = parameters.hold_authority if possible else 0.0
            again = held and parameters.model_free
            pause = stable_above(coupled, omega, amplitude) if again else None
            for number, start in enumerate(planned, 1):
                name = f"start {number} of beta = {beta:g} at omega = {omega:g} rad/s"
                stage = Stage(name, start.segments, start.chance)
                # any motion that does not become steady is held, which is not expected here
                control = authority if held else _beyond(start.segments, authority)
                yield Trial(stage, coupled, (), HOLD, longest + extra, beta, omega, control)
                if again and (segments := with_pause(start, pause)) != start.segments:
                    stage = Stage(f"second {name}", segments, start.chance)
                    yield Trial(stage, coupled, (), HOLD, extra, beta, omega, authority)


def _beyond(segments: Sequence[Segment], authority: float) -> float:
    """Share by which the drive of a hold with this `authority` may exceed the largest sine of a start at the same
    frequency.
    """
    last = segments[-1]
    largest = max(each.amplitude for each in segments if each.omega == last.omega)
    return max((1.0 + authority) * last.amplitude / largest - 1.0, 0.0)


def _bare_tests(parameters: HarmonicParameters, specimen: Specimen) -> Iterator[Trial]:
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    before: tuple[Segment, ...] = ()
    for omega in parameters.omega:
        segment = Segment(BARE_CHANGE if before else parameters.ramp_time, amplitude, omega)
        stage = Stage(f"the bare frame at omega = {omega:g} rad/s", (segment,))
        longest = _longest_dwell(parameters)
        yield Trial(stage, specimen.bare(), before, hold=BARE_HOLD, longest=longest, steady=omega)
        # the next stage starts from this motion after BARE_HOLD seconds, when the damping has reduced its transient
        before = (Segment(parameters.ramp_time, amplitude, omega), replace(segment, duration=BARE_HOLD))


def _longest_dwell(parameters: HarmonicParameters) -> float:
    return parameters.settle_limit + parameters.measured_cycles * tau / min(parameters.omega)


def forecast(
    parameters: HarmonicParameters,
    configuration: BenchConfiguration,
    starts: Mapping[tuple[float, float], Sequence[Start]],
    steady: Callable[[float | None, float], Travel | None],
    progress: Progress = silent,
) -> Forecast:
    """Stages of the campaign, with their demands.

    `steady` returns the steady motion at a stiffness ratio and frequency [rad/s]. Raises InvalidInput for a table model
    that cannot be read or does not cover the frequencies.
    """
    found = list(trials(parameters, configuration, response_of(configuration), starts))
    return Forecast(
        demands=demands_of(found, configuration, steady, progress),
        stages=tuple(trial.stage for trial in found),
        duration=Pace(parameters.omega, 1 + len(parameters.beta)).progress("").remaining,
    )
