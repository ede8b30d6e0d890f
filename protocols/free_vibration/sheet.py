"""The lab sheet of the free vibration test.

1. The block is taken off. By hand: the table is locked, the frame pulled aside before each decay, and let go.
2. By a pulse: the table is probed from a drive too small to do harm up to the drift.
3. Each decay is recorded, fitted, and told; a decay that cannot be used is repeated once.
4. All decays together make the result.
"""

from collections.abc import Generator
from dataclasses import dataclass

from bench.analysis.free_decay.decay import Decay, Setting
from bench.config.model import BenchConfiguration
from bench.engine.steps import Handle, Outcome, Plan, Say, Step
from bench.events import PointFinished, SpecimenIdentified, Warned
from drivers.rig import Handwork
from protocols.free_vibration.decays import LETTING_GO, probing_duration, pulsed_decays, released_decays
from protocols.free_vibration.parameters import DecayParameters, FreeVibrationParameters
from protocols.free_vibration.playing import WAITING, Pace
from protocols.free_vibration.pulse import Pulse, planned, window_of
from protocols.free_vibration.results import FrameResult, point_of, result_of
from protocols.free_vibration.told import findings_of, impossible
from protocols.free_vibration.weighed import masses_told, masses_weighed
from sim.errors import RockbenchError
from sim.identified import Identified
from sim.specimen import Specimen

LOCK = "Clamp the table to the ground: it must not move, and it is not driven."


@dataclass
class Bench:
    """What the run has found, and whether the table is clamped."""

    result: FrameResult | None = None
    locked: bool = False


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


def expected_duration(parameters: FreeVibrationParameters, configuration: BenchConfiguration) -> float:
    """Expected length of a test [s]."""
    specimen = configuration.known_specimen.bare()
    if parameters.excitation == "hand":
        return parameters.repeats * (LETTING_GO + window_of(parameters, specimen) + WAITING)
    return pulsed_duration(parameters, planned(parameters, configuration, specimen).pulse)


def pulsed_duration(parameters: DecayParameters, pulse: Pulse) -> float:
    """Expected length of the decays after pulses [s]."""
    return probing_duration(pulse) + parameters.repeats * (pulse.length + WAITING)


def free_vibration_plan(parameters: FreeVibrationParameters, configuration: BenchConfiguration, bench: Bench) -> Plan:
    """The whole test as steps; `bench` is kept up to date."""
    specimen = configuration.known_specimen.bare()
    setting, pace = setting_of(parameters, configuration), Pace(expected_duration(parameters, configuration))
    yield from masses_told(configuration)
    yield Handle(Handwork.REMOVE_BLOCK, specimen, "Take the spring and the block off the table.")
    if parameters.excitation == "hand":
        decays = yield from _locked_decays(parameters, specimen, setting, pace, bench)
    else:
        found = planned(parameters, configuration, specimen)
        decays = yield from pulsed_decays(parameters, configuration, found, setting, pace, "free vibration")
    result = result_of(decays, setting.masses, setting.weighed)
    bench.result = result
    if result.nonlinear.any():
        yield Say(Warned(nonlinear_text(result)))
    yield Say(PointFinished(point_of(result, 0)))
    if (left_out := impossible(result)) is not None:
        yield Say(Warned(left_out))
    known = configuration.identified or Identified()
    yield Say(SpecimenIdentified(known.extended(*findings_of(result, known))))


def _locked_decays(
    parameters: FreeVibrationParameters, specimen: Specimen, setting: Setting, pace: Pace, bench: Bench
) -> Generator[Step, Outcome, list[Decay]]:
    """Decays on a table that is clamped for them, and not left so where they cannot be used."""
    bench.locked = True
    yield Handle(Handwork.LOCK_TABLE, specimen, LOCK)
    decays: list[Decay] = []
    failed: RockbenchError | None = None
    try:
        decays = yield from released_decays(parameters, specimen, setting, pace)
    except RockbenchError as error:
        failed = error
    yield Handle(Handwork.UNLOCK_TABLE, specimen, "Take the clamp off the table.")
    bench.locked = False
    if failed is not None:
        raise failed
    return decays


def nonlinear_text(result: FrameResult) -> str:
    """That the damping depends on the amplitude, and by how much."""
    told = [
        f"xi{mode + 1} changes by {slope:.2g} +- {doubt:.1g} per metre of drift"
        for mode, (slope, doubt) in enumerate(zip(result.slopes.values, result.slope_uncertainty, strict=True))
        if result.nonlinear[mode]
    ]
    return f"the damping depends on the amplitude: {', '.join(told)}; what is stated is its mean over the decays"
