"""Identification of the stiffness of mounted springs, which is written to a specimen file for other runs.

1. Decays of the bare frame are measured after pulses, unless a previous identification is used.
2. Each spring is mounted with the block clamped to the table, and decays are measured again.
3. The stiffness of the spring is the difference between the two stiffnesses of the first storey.
"""

from collections.abc import Callable, Generator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.free_decay.decay import Setting
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_specimen
from bench.datafile.tables import Column, Table
from bench.engine.steps import OperatorAction, Outcome, Publish, Step
from bench.events import PointFinished, Warned
from bench.figures.style import write_figure
from bench.findings import SpecimenIdentified
from bench.preflight.margins import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from drivers.rig import OperatorTask
from protocols.common.decays.findings import check_masses, impossible_values, mass_warning
from protocols.common.decays.frame import SIGNIFICANT, FrameResult, frame_result, nonlinear_text
from protocols.common.decays.pulse import frequencies, plan_pulse, pulse_forecast
from protocols.common.decays.recording import Pace, fit_setting, pulsed_decays, pulsed_duration
from protocols.coupling_stiffness.protocol import CouplingStiffnessParameters, SpringPoint
from protocols.coupling_stiffness.results import springs_figure, springs_table
from protocols.coupling_stiffness.springs import (
    Reference,
    SpringResult,
    bare_point,
    frame_change,
    identified_reference,
    measured_reference,
    spring_findings,
    spring_point,
    spring_result,
)
from sim.errors import InvalidInput, RockbenchError
from sim.identified import Identified, possible, spring_name
from sim.parameters import Parameters
from sim.specimen import Specimen

BARE, SPRING = "bare frame", "spring of beta = {:g}"
"""Names of the mounted specimens."""

BY_HAND = 120.0
"""Expected time to change the specimen by hand [s]."""

STILL_CLAMPED = (
    "THE BLOCK IS STILL CLAMPED to the table: remove the clamp, the spring and the block before the table is driven."
)


class CouplingStiffness(Prepared[CouplingStiffnessParameters]):
    """Spring identification. Raises InvalidInput if there is no reference frame, or if the limits forbid a usable
    pulse.
    """

    def __init__(
        self, parameters: CouplingStiffnessParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        identified, known = configuration.identified, configuration.known_specimen
        if not parameters.reference and not (identified is not None and {"k1", "k2"} <= set(identified.names)):
            allowed = (
                "k1 and k2 are not identified: include the bare frame, or specify a specimen file that contains them"
            )
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
        """Whether the block is clamped to the table."""

    @property
    def _duration(self) -> float:
        """Expected duration of a run [s]."""
        return sum(pulsed_duration(self.parameters, plan.pulse) + BY_HAND for plan in self._pulses.values())

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting the demands of the run")
        return pulse_forecast(self.configuration, self._pulses, self._duration)

    @cached_property
    def prediction(self) -> Table:
        """Modes with every spring, from the nominal stiffnesses."""
        known, beta = self.configuration.known_specimen, self.parameters.beta
        omega = np.array([np.sort(frequencies(known.coupled(each))) for each in beta])
        stiffness = np.array([known.coupled(each).nominal_k_c for each in beta])
        return {
            "beta": Column(np.array(beta), "1", "stiffness ratio on the label"),
            "k_c": Column(stiffness, "N/m", "nominal stiffness on the label"),
            "omega1": Column(omega[:, 0], "rad/s", "first undamped circular frequency with the block clamped"),
            "omega2": Column(omega[:, 1], "rad/s", "second undamped circular frequency with the block clamped"),
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
            yield OperatorAction(OperatorTask.REMOVE_BLOCK, bare, "Remove the spring and the block from the table.")
            found = self._bare = yield from self._decays(BARE, setting, pace)
            reference = measured_reference(found)
            if (off := frame_change(found, configuration.identified)) is not None:
                yield Publish(Warned(f"the bare frame has changed since it was identified: {off}"))
            yield Publish(PointFinished(bare_point(found, 0)))
            if (left_out := impossible_values(found)) is not None:
                yield Publish(Warned(left_out))
        if reference is None:
            raise AssertionError("unreachable: a run without a reference is refused")
        failed: RockbenchError | None = None
        try:
            for beta in p.beta:
                self._clamped = True
                spring = yield from self._spring(beta, reference, setting, pace)
                self._springs.append(spring)
                identified = configuration.identified or Identified()
                yield Publish(
                    SpecimenIdentified(identified.extended(*spring_findings(self._bare, self._springs, identified)))
                )
        except RockbenchError as error:
            failed = error
        yield OperatorAction(
            OperatorTask.REMOVE_BLOCK, bare, "Remove the clamp, the spring and the block from the table."
        )
        self._clamped = False
        if failed is not None:
            raise failed

    def _spring(
        self, beta: float, reference: Reference, setting: Setting, pace: Pace
    ) -> Generator[Step, Outcome, SpringResult]:
        name = SPRING.format(beta)
        specimen = self._specimens[name]
        request = (
            f"Set the block upright on its base, mount the spring of beta = {beta:g}, and clamp the block to the "
            "table: it must not lift, slide or turn."
        )
        yield OperatorAction(OperatorTask.HOLD_BLOCK, specimen, request)

        def point(result: FrameResult, number: int) -> SpringPoint:
            return spring_point(spring_result(beta, result, reference), specimen.nominal_k_c, number)

        held = yield from self._decays(name, setting, pace, point)
        spring = spring_result(beta, held, reference)
        if abs(spring.k2_apart) > SIGNIFICANT:
            yield Publish(
                Warned(
                    f"{name}: k2 differs from its value for the bare frame by {spring.k2_apart:+.1f} standard "
                    "uncertainties: check whether the block, its clamp or the spring touches the second storey, and "
                    "whether the clamp yields under the force of the spring",
                )
            )
        if not possible(spring_name(beta), spring.k_c):
            yield Publish(
                Warned(
                    f"{name}: k_C = {spring.k_c:.3g} N/m is physically impossible and not stored for other runs, which "
                    "keep an earlier value, if there is one: check whether the spring is mounted"
                )
            )
        yield Publish(PointFinished(point(held, 0)))
        return spring

    def _decays(
        self,
        name: str,
        setting: Setting,
        pace: Pace,
        point: Callable[[FrameResult, int], SpringPoint] = bare_point,
    ) -> Generator[Step, Outcome, FrameResult]:
        """Combined result of the decays of the specimen `name`, with a point published for each decay."""
        pace.elapsed += BY_HAND
        pulse = self._pulses[name]
        decays = yield from pulsed_decays(self.parameters, self.configuration, pulse, setting, pace, name, point)
        result = frame_result(decays, setting.masses, setting.masses_covariance)
        if result.nonlinear.any():
            yield Publish(Warned(f"{name}: {nonlinear_text(result)}"))
        return result
