"""The decays of one frame: recorded, fitted, told. One that cannot be used is repeated once, then left out."""

from collections.abc import Callable, Generator

import numpy as np

from bench.analysis.free_decay.decay import Decay, Setting, pulsed_decay, released_decay
from bench.analysis.free_decay.stretch import Unusable
from bench.config.model import BenchConfiguration
from bench.engine.steps import Handle, Outcome, Say, Step
from bench.events import PointFinished, StepStarted, Warned
from drivers.rig import Handwork
from protocols.common.calibrate import Unmeasurable
from protocols.common.decays.findings import fit_finished
from protocols.common.decays.masses import masses_weighed
from protocols.common.decays.parameters import DecayParameters
from protocols.common.decays.playing import WAITING, Pace, found_level, played
from protocols.common.decays.pulse import QUIET, Planned, Pulse, window_of
from protocols.common.decays.results import FrameResult, point_of, result_of
from sim.parameters import Parameters
from sim.specimen import Specimen

LETTING_GO = 6.0
"""Time for which a hand is waited for [s]."""

Telling = Callable[[FrameResult, int], Parameters]
"""Makes the point of a result; the number is 0 for all decays together."""

PROBES = 3
"""Probes that most tables take: for the expected duration."""

_TRIES = 2
"""How often a decay is tried that cannot be used."""


def pulsed_decays(
    parameters: DecayParameters,
    configuration: BenchConfiguration,
    found: Planned,
    setting: Setting,
    pace: Pace,
    name: str,
    told: Telling = point_of,
) -> Generator[Step, Outcome, list[Decay]]:
    """Find the level, then record the decays; `told` makes the point of each.

    Raises Unmeasurable when none can be used.
    """
    yield Say(StepStarted(f"{name}: {1e3 * found.drift:.3g} mm of drift, {_reason(found)}"))
    pulse = found.pulse
    begun = pace.gone
    volts = yield from found_level(pulse, found.drift, configuration, pace)
    pace.over(begun, probing_duration(pulse))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        signals = yield from played(pulse.record(volts), pulse.sample_rate, pace, activity)
        return pulsed_decay(signals, setting, QUIET, pulse.begin)

    how = f"a pulse of {volts:.3g} V, {pulse.length:.0f} s"
    planned = pulse.length + WAITING
    return (yield from _repeated(parameters, setting, pace, planned, once, name, how, told))


def released_decays(
    parameters: DecayParameters, pull: float, specimen: Specimen, setting: Setting, pace: Pace
) -> Generator[Step, Outcome, list[Decay]]:
    window = window_of(parameters, specimen)
    silence = np.zeros(round((LETTING_GO + window) * setting.sample_rate))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        request = (
            f"Hold storey 2 aside by {1e3 * pull:g} mm, without touching storey 1, and let it go without a push once"
            " the recording has begun."
        )
        yield Handle(Handwork.PULL_FRAME, specimen, request, pull)
        signals = yield from played(silence, setting.sample_rate, pace, activity)
        return released_decay(signals, setting)

    how = f"let go by hand, {window:.0f} s"
    planned = LETTING_GO + window + WAITING
    return (yield from _repeated(parameters, setting, pace, planned, once, "free vibration", how, point_of))


def _repeated(
    parameters: DecayParameters,
    setting: Setting,
    pace: Pace,
    planned: float,
    once: Callable[[str], Generator[Step, Outcome, Decay]],
    name: str,
    how: str,
    told: Telling,
) -> Generator[Step, Outcome, list[Decay]]:
    """`planned` is the expected time of one decay [s]."""
    decays: list[Decay] = []
    for number in range(1, parameters.repeats + 1):
        begun = pace.gone
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
            yield Say(PointFinished(told(result_of([decay], setting.masses, setting.weighed), number)))
            break
        pace.over(begun, planned)
        yield Say(pace.progress(f"finished {name} {number} of {parameters.repeats}"))
    if not decays:
        raise Unmeasurable("no decay could be used: see the warnings of this run")
    return decays


def probing_duration(pulse: Pulse) -> float:
    """Expected time of the probes before the decays [s]."""
    return PROBES * (pulse.begin + WAITING)


def setting_of(parameters: DecayParameters, configuration: BenchConfiguration) -> Setting:
    """What is known before the first decay. Masses that are identified have the uncertainty that goes with them."""
    frame = configuration.known_specimen.frame
    return Setting(
        sample_rate=configuration.sample_rate,
        ranges=configuration.laser_ranges,
        on_table=configuration.laser_reference == "table",
        accuracy=configuration.analysis,
        masses=(frame.m1, frame.m2),
        weighed=masses_weighed(parameters, configuration.identified),
    )


def pulsed_duration(parameters: DecayParameters, pulse: Pulse) -> float:
    """Expected length of the decays after pulses [s]."""
    return probing_duration(pulse) + parameters.repeats * (pulse.length + WAITING)


def _reason(found: Planned) -> str:
    return "as asked for" if found.binds == "drift asked for" else f"{found.binds} allows no more"
