"""The stiffness of mounted springs on a bench, as a file that other runs load.

1. The bare frame: decays after pulses, unless it was identified before and is not to be measured again.
2. For each spring: it is mounted with its block clamped to the table, and the same is done.
3. The difference of the first storeys' stiffnesses is the spring's.
"""

from collections.abc import Callable, Generator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.free_decay.decay import Setting
from bench.config.model import BenchConfiguration
from bench.config.specimen_file import write_specimen
from bench.engine.steps import Handle, Outcome, Say, Step
from bench.events import PointFinished, SpecimenIdentified, Warned
from bench.preflight.forecast import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from drivers.rig import Handwork
from protocols.common.decays.decays import fit_setting, pulsed_decays, pulsed_duration
from protocols.common.decays.findings import check_masses, mass_warning
from protocols.common.decays.frame import SIGNIFICANT, FrameResult, frame_result, nonlinear_text
from protocols.common.decays.pulse import frequencies, plan_pulse, pulse_forecast
from protocols.common.decays.recording import Pace
from protocols.coupling_stiffness.difference import (
    Reference,
    SpringResult,
    frame_change,
    identified_reference,
    measured_reference,
    spring_result,
)
from protocols.coupling_stiffness.findings import bare_point, spring_findings, spring_point
from protocols.coupling_stiffness.protocol import CouplingStiffnessParameters, SpringPoint
from protocols.coupling_stiffness.results import springs_figure, springs_table
from sim.errors import InvalidInput, RockbenchError
from sim.identified import Identified
from sim.parameters import Parameters
from sim.specimen import Specimen

BARE, SPRING = "bare frame", "spring of beta = {:g}"
"""Names of the specimens on the table."""

BY_HAND = 120.0
"""Time to mount a spring [s]."""

STILL_CLAMPED = "THE BLOCK IS STILL CLAMPED to the table: take clamp, spring and block off before it is driven."


class CouplingStiffness(Prepared[CouplingStiffnessParameters]):
    """Refuses a run with nothing to compare with, and a pulse that this bench cannot make."""

    def __init__(
        self, parameters: CouplingStiffnessParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        identified, known = configuration.identified, configuration.known_specimen
        if not parameters.reference and not (identified is not None and {"k1", "k2"} <= set(identified.names)):
            allowed = "k1 and k2 are not identified: measure the bare frame along, or name a specimen file with them"
            raise InvalidInput("reference", False, allowed)
        self._specimens: dict[str, Specimen] = {BARE: known.bare()} if parameters.reference else {}
        self._specimens |= {SPRING.format(beta): known.coupled(beta) for beta in parameters.beta}
        check_masses(parameters, configuration)
        self._pulses = {
            name: plan_pulse(parameters, configuration, specimen) for name, specimen in self._specimens.items()
        }
        self._bare: FrameResult | None = None
        self._springs: list[SpringResult] = []
        self._clamped = False
        """True while a block is clamped to the table."""

    @property
    def _duration(self) -> float:
        """Expected length of a run [s]."""
        return sum(pulsed_duration(self.parameters, plan.pulse) + BY_HAND for plan in self._pulses.values())

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting what the run asks of the bench")
        return pulse_forecast(self.configuration, self._pulses, self._duration)

    @cached_property
    def prediction(self) -> Table:
        """The modes with every spring, as its label has it."""
        known, beta = self.configuration.known_specimen, self.parameters.beta
        omega = np.array([np.sort(frequencies(known.coupled(each))) for each in beta])
        stiffness = np.array([known.coupled(each).nominal_k_c for each in beta])
        return {
            "beta": Column(np.array(beta), "1", "stiffness ratio on the label"),
            "k_c": Column(stiffness, "N/m", "stiffness that the label promises"),
            "omega1": Column(omega[:, 0], "rad/s", "first undamped circular frequency with the block held"),
            "omega2": Column(omega[:, 1], "rad/s", "second undamped circular frequency with the block held"),
        }

    def plan(self) -> Plan:
        self._bare, self._springs, self._clamped = None, [], False
        return self.collected(self._steps())

    def result(self, points: Sequence[Parameters]) -> Result:
        known, bare, springs = self.configuration.identified or Identified(), self._bare, tuple(self._springs)

        def write(path: Path) -> None:
            write_specimen(path, known.extended(*spring_findings(bare, springs, known)))

        text = springs_table([point for point in points if isinstance(point, SpringPoint)])
        return Result(
            points=tuple(points),
            text=f"{text}\n{STILL_CLAMPED}" if self._clamped else text,
            figures={"coupling_stiffness.png": lambda path: write_figure(path, springs_figure(springs))},
            files={"specimen.json": write} if bare is not None or springs else {},
        )

    def _steps(self) -> Generator[Step, Outcome, None]:
        p, configuration = self.parameters, self.configuration
        setting, pace = fit_setting(p, configuration), Pace(self._duration)
        bare = configuration.known_specimen.bare()
        reference = identified_reference(configuration.identified)
        yield from mass_warning(configuration)
        if p.reference:
            yield Handle(Handwork.REMOVE_BLOCK, bare, "Take the spring and the block off the table.")
            found = self._bare = yield from self._decays(BARE, setting, pace)
            reference = measured_reference(found)
            if (off := frame_change(found, configuration.identified)) is not None:
                yield Say(Warned(f"the bare frame is not what it was when it was identified: {off}"))
            yield Say(PointFinished(bare_point(found, 0)))
        if reference is None:
            raise AssertionError("a run without a reference is refused beforehand")
        failed: RockbenchError | None = None
        try:
            for beta in p.beta:
                self._clamped = True
                spring = yield from self._spring(beta, reference, setting, pace)
                self._springs.append(spring)
                identified = configuration.identified or Identified()
                yield Say(
                    SpecimenIdentified(identified.extended(*spring_findings(self._bare, self._springs, identified)))
                )
        except RockbenchError as error:
            failed = error
        yield Handle(Handwork.REMOVE_BLOCK, bare, "Take the clamp, the spring and the block off the table.")
        self._clamped = False
        if failed is not None:
            raise failed

    def _spring(
        self, beta: float, reference: Reference, setting: Setting, pace: Pace
    ) -> Generator[Step, Outcome, SpringResult]:
        name = SPRING.format(beta)
        specimen = self._specimens[name]
        request = (
            f"Stand the block on its base, mount the spring of beta = {beta:g}, and clamp the block to the table: it"
            " must not lift, slide or turn."
        )
        yield Handle(Handwork.HOLD_BLOCK, specimen, request)

        def point(result: FrameResult, number: int) -> SpringPoint:
            return spring_point(spring_result(beta, result, reference), specimen.nominal_k_c, number)

        held = yield from self._decays(name, setting, pace, point)
        spring = spring_result(beta, held, reference)
        if abs(spring.k2_apart) > SIGNIFICANT:
            yield Say(
                Warned(
                    f"{name}: k2 is {spring.k2_apart:+.1f} standard uncertainties off that of the bare frame: see"
                    " whether the block, its clamp or the spring touch the second storey, or give under the spring",
                )
            )
        yield Say(PointFinished(point(held, 0)))
        return spring

    def _decays(
        self,
        name: str,
        setting: Setting,
        pace: Pace,
        point: Callable[[FrameResult, int], SpringPoint] = bare_point,
    ) -> Generator[Step, Outcome, FrameResult]:
        """The decays of one frame, which has just been mounted, with a point for each."""
        pace.elapsed += BY_HAND
        pulse = self._pulses[name]
        decays = yield from pulsed_decays(self.parameters, self.configuration, pulse, setting, pace, name, point)
        result = frame_result(decays, setting.masses, setting.weighed)
        if result.nonlinear.any():
            yield Say(Warned(f"{name}: {nonlinear_text(result)}"))
        return result
