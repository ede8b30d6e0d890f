"""The decays of one frame: recorded, fitted, published. An unusable decay is repeated once, then left out."""

from collections.abc import Callable, Generator

from bench.analysis.free_decay.decay import Decay, Setting, pulsed_decay
from bench.analysis.free_decay.stretch import Unusable
from bench.config.model import BenchConfiguration
from bench.engine.steps import Outcome, Say, Step
from bench.events import PointFinished, StepStarted, Warned
from protocols.common.calibrate import Unmeasurable
from protocols.common.decays.findings import fit_finished, mass_covariance
from protocols.common.decays.frame import FrameResult, decay_point, frame_result
from protocols.common.decays.parameters import DecayParameters
from protocols.common.decays.pulse import QUIET, PlannedPulse, Pulse
from protocols.common.decays.recording import WAITING, Pace, find_level, record
from sim.parameters import Parameters

PointMaker = Callable[[FrameResult, int], Parameters]
"""Makes the point of a result; the number is 0 for all decays together."""

PROBES = 3
"""Probes that most tables take: for the expected duration."""

_TRIES = 2
"""Attempts at a decay that cannot be used."""


def pulsed_decays(
    parameters: DecayParameters,
    configuration: BenchConfiguration,
    planned: PlannedPulse,
    setting: Setting,
    pace: Pace,
    name: str,
    point: PointMaker = decay_point,
) -> Generator[Step, Outcome, list[Decay]]:
    """Find the level, then record the decays; `point` makes the point of each.

    Raises Unmeasurable when none can be used.
    """
    yield Say(StepStarted(f"{name}: {1e3 * planned.drift:.3g} mm of drift, {_reason(planned)}"))
    pulse = planned.pulse
    begun = pace.elapsed
    volts = yield from find_level(pulse, planned.drift, configuration, pace)
    pace.finish(begun, _probing_duration(pulse))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        signals = yield from record(pulse.record(volts), pulse.sample_rate, pace, activity)
        return pulsed_decay(signals, setting, QUIET, pulse.begin)

    how = f"a pulse of {volts:.3g} V, {pulse.length:.0f} s"
    length = pulse.length + WAITING
    return (yield from repeat_decays(parameters, setting, pace, length, once, name, how, point))


def repeat_decays(
    parameters: DecayParameters,
    setting: Setting,
    pace: Pace,
    planned: float,
    once: Callable[[str], Generator[Step, Outcome, Decay]],
    name: str,
    how: str,
    point: PointMaker = decay_point,
) -> Generator[Step, Outcome, list[Decay]]:
    """Record decays by `once`, each in at most two attempts, and publish the fit and the point of each.

    `planned` is the expected time of one decay [s], `name` and `how` describe it. Raises Unmeasurable when none can be
    used.
    """
    decays: list[Decay] = []
    for number in range(1, parameters.repeats + 1):
        begun = pace.elapsed
        for attempt in range(_TRIES):
            yield Say(StepStarted(f"{name} {number} of {parameters.repeats}: {how}"))
            try:
                decay = yield from once(f"{name} {number} of {parameters.repeats}")
            except Unusable as refusal:
                again = "it is repeated" if attempt + 1 < _TRIES else "it is left out"
                yield Say(Warned(f"{name} {number}: {refusal}; {again}"))
                continue
            decays.append(decay)
            yield Say(fit_finished(decay, f"{name} {number}"))
            yield Say(PointFinished(point(frame_result([decay], setting.masses, setting.weighed), number)))
            break
        pace.finish(begun, planned)
        yield Say(pace.progress(f"finished {name} {number} of {parameters.repeats}"))
    if not decays:
        raise Unmeasurable("no decay could be used: see the warnings of this run")
    return decays


def fit_setting(parameters: DecayParameters, configuration: BenchConfiguration) -> Setting:
    """The known values for the fit of a decay. Masses that are identified have their own covariance."""
    frame = configuration.known_specimen.frame
    return Setting(
        sample_rate=configuration.sample_rate,
        ranges=configuration.laser_ranges,
        on_table=configuration.laser_reference == "table",
        accuracy=configuration.analysis,
        masses=(frame.m1, frame.m2),
        weighed=mass_covariance(parameters, configuration.identified),
    )


def pulsed_duration(parameters: DecayParameters, pulse: Pulse) -> float:
    """Expected length of the decays after pulses [s]."""
    return _probing_duration(pulse) + parameters.repeats * (pulse.length + WAITING)


def _probing_duration(pulse: Pulse) -> float:
    """Expected time of the probes before the decays [s]."""
    return PROBES * (pulse.begin + WAITING)


def _reason(planned: PlannedPulse) -> str:
    return "as asked for" if planned.binds == "drift asked for" else f"{planned.binds} allows no more"
