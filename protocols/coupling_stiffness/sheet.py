"""The lab sheet of the test of the springs.

1. The bare frame: decays after pulses, unless it was identified before and is not to be measured again.
2. For each spring: it is mounted with its block clamped to the table, and the same is done.
3. The difference of the first storeys' stiffnesses is the spring's.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field

from bench.analysis.free_decay.decay import Setting
from bench.config.model import BenchConfiguration
from bench.engine.steps import Handle, Outcome, Plan, Say, Step
from bench.events import PointFinished, SpecimenIdentified, Warned
from drivers.rig import Handwork
from protocols.coupling_stiffness.difference import (
    Reference,
    SpringResult,
    changed,
    known_reference,
    reference_of,
    spring_of,
)
from protocols.coupling_stiffness.parameters import CouplingStiffnessParameters
from protocols.coupling_stiffness.point import SpringPoint
from protocols.coupling_stiffness.told import bare_point, spring_findings, spring_point
from protocols.free_vibration.decays import pulsed_decays
from protocols.free_vibration.playing import Pace
from protocols.free_vibration.pulse import planned
from protocols.free_vibration.results import SIGNIFICANT, FrameResult, result_of
from protocols.free_vibration.sheet import nonlinear_text, pulsed_duration, setting_of
from protocols.free_vibration.weighed import masses_told
from sim.errors import RockbenchError
from sim.identified import Identified
from sim.specimen import Specimen

BY_HAND = 120.0
"""Time to mount a spring [s]."""


@dataclass
class Bench:
    """What the run has found: the bare frame, None where it was not measured, and the springs; and whether a block is
    clamped.
    """

    bare: FrameResult | None = None
    springs: list[SpringResult] = field(default_factory=list[SpringResult])
    clamped: bool = False


def specimens_of(parameters: CouplingStiffnessParameters, configuration: BenchConfiguration) -> dict[str, Specimen]:
    """What stands on the table in turn, by name."""
    known = configuration.known_specimen
    bare = {"bare frame": known.bare()} if parameters.reference else {}
    return bare | {f"spring of beta = {beta:g}": known.coupled(beta) for beta in parameters.beta}


def expected_duration(parameters: CouplingStiffnessParameters, configuration: BenchConfiguration) -> float:
    """Expected length of a run [s]."""
    plans = [planned(parameters, configuration, each) for each in specimens_of(parameters, configuration).values()]
    return sum(pulsed_duration(parameters, plan.pulse) + BY_HAND for plan in plans)


def coupling_stiffness_plan(
    parameters: CouplingStiffnessParameters, configuration: BenchConfiguration, bench: Bench
) -> Plan:
    """The whole run as steps; `bench` is kept up to date."""
    setting, pace = setting_of(parameters, configuration), Pace(expected_duration(parameters, configuration))
    known = configuration.known_specimen
    reference = known_reference(configuration.identified)
    yield from masses_told(configuration)
    if parameters.reference:
        request = "Take the spring and the block off the table."
        yield Handle(Handwork.REMOVE_BLOCK, known.bare(), request)
        bench.bare = yield from _decays(parameters, configuration, known.bare(), "bare frame", setting, pace)
        reference = reference_of(bench.bare)
        if (off := changed(bench.bare, configuration.identified)) is not None:
            yield Say(Warned(f"the bare frame is not what it was when it was identified: {off}"))
        yield Say(PointFinished(bare_point(bench.bare, 0)))
    if reference is None:
        raise AssertionError("a run without a reference is refused beforehand")
    failed: RockbenchError | None = None
    try:
        for beta in parameters.beta:
            bench.clamped = True
            spring = yield from _spring(parameters, configuration, beta, reference, setting, pace)
            bench.springs.append(spring)
            identified = configuration.identified or Identified()
            found = spring_findings(bench.bare, bench.springs, identified)
            yield Say(SpecimenIdentified(identified.extended(*found)))
    except RockbenchError as error:
        failed = error
    yield Handle(Handwork.REMOVE_BLOCK, known.bare(), "Take the clamp, the spring and the block off the table.")
    bench.clamped = False
    if failed is not None:
        raise failed


def _spring(
    parameters: CouplingStiffnessParameters,
    configuration: BenchConfiguration,
    beta: float,
    reference: Reference,
    setting: Setting,
    pace: Pace,
) -> Generator[Step, Outcome, SpringResult]:
    specimen = configuration.known_specimen.coupled(beta)
    request = (
        f"Stand the block on its base, mount the spring of beta = {beta:g}, and clamp the block to the table: it must"
        " not lift, slide or turn."
    )
    yield Handle(Handwork.HOLD_BLOCK, specimen, request)
    name = f"spring of beta = {beta:g}"

    def told(result: FrameResult, number: int) -> SpringPoint:
        return spring_point(spring_of(beta, result, reference), specimen.nominal_k_c, number)

    held = yield from _decays(parameters, configuration, specimen, name, setting, pace, told)
    spring = spring_of(beta, held, reference)
    if abs(spring.k2_apart) > SIGNIFICANT:
        yield Say(
            Warned(
                f"{name}: k2 is {spring.k2_apart:+.1f} standard uncertainties off that of the bare frame: see whether"
                " the block, its clamp or the spring touch the second storey, or give under the spring",
            )
        )
    yield Say(PointFinished(told(held, 0)))
    return spring


def _decays(
    parameters: CouplingStiffnessParameters,
    configuration: BenchConfiguration,
    specimen: Specimen,
    name: str,
    setting: Setting,
    pace: Pace,
    told: Callable[[FrameResult, int], SpringPoint] | None = None,
) -> Generator[Step, Outcome, FrameResult]:
    """The decays of one frame, which has just been mounted, with a point for each."""
    pace.gone += BY_HAND
    found = planned(parameters, configuration, specimen)
    decays = yield from pulsed_decays(parameters, configuration, found, setting, pace, name, told=told or bare_point)
    result = result_of(decays, setting.masses, setting.weighed)
    if result.nonlinear.any():
        yield Say(Warned(f"{name}: {nonlinear_text(result)}"))
    return result
