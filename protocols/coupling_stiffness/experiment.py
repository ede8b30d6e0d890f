"""The test of the springs as a session takes it."""

from collections.abc import Sequence
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Column, Table
from protocols.coupling_stiffness.parameters import CouplingStiffnessParameters
from protocols.coupling_stiffness.point import SpringPoint
from protocols.coupling_stiffness.sheet import Bench
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.parameters import Parameters

STILL_CLAMPED = "THE BLOCK IS STILL CLAMPED to the table: take clamp, spring and block off before it is driven."


class CouplingStiffness:
    """The stiffness of mounted springs, as a file that other runs load."""

    name = "coupling-stiffness"
    figure_name = "coupling_stiffness.png"
    kept_name = "specimen.json"
    point_type: type[Parameters] = SpringPoint

    def __init__(self, parameters: CouplingStiffnessParameters) -> None:
        self.parameters = parameters
        self._known: Identified | None = None
        self._bench = Bench()

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput where there is nothing to compare with, or for a pulse that this bench cannot make."""
        from protocols.coupling_stiffness.sheet import specimens_of
        from protocols.free_vibration.checks import check_pulse

        known = configuration.identified
        if not self.parameters.reference and not (known is not None and {"k1", "k2"} <= set(known.names)):
            allowed = "k1 and k2 are not identified: measure the bare frame along, or name a specimen file with them"
            raise InvalidInput("reference", False, allowed)
        for specimen in specimens_of(self.parameters, configuration).values():
            check_pulse(self.parameters, configuration, specimen)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """The most that is asked of every limited quantity."""
        from protocols.coupling_stiffness.sheet import expected_duration, specimens_of
        from protocols.free_vibration.preflight import pulse_forecast
        from protocols.free_vibration.pulse import planned

        progress("predicting what the run asks of the bench")
        plans = {
            name: planned(self.parameters, configuration, specimen)
            for name, specimen in specimens_of(self.parameters, configuration).items()
        }
        return pulse_forecast(configuration, plans, expected_duration(self.parameters, configuration))

    def predict(self, configuration: BenchConfiguration) -> Table:
        """The modes with every spring, as its label has it."""
        import numpy as np

        from protocols.free_vibration.pulse import frequencies

        known = configuration.known_specimen
        omega = np.array([np.sort(frequencies(known.coupled(beta))) for beta in self.parameters.beta])
        stiffness = np.array([known.coupled(beta).nominal_k_c for beta in self.parameters.beta])
        return {
            "beta": Column(np.array(self.parameters.beta), "1", "stiffness ratio on the label"),
            "k_c": Column(stiffness, "N/m", "stiffness that the label promises"),
            "omega1": Column(omega[:, 0], "rad/s", "first undamped circular frequency with the block held"),
            "omega2": Column(omega[:, 1], "rad/s", "second undamped circular frequency with the block held"),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.coupling_stiffness.sheet import coupling_stiffness_plan

        self._known, self._bench = configuration.identified, Bench()
        return coupling_stiffness_plan(self.parameters, configuration, self._bench)

    def keep(self, path: Path) -> None:
        """Write what is known of the specimen for other runs, if anything was found."""
        from bench.config.specimen_file import write_specimen
        from protocols.coupling_stiffness.told import spring_findings

        known, bench = self._known or Identified(), self._bench
        if bench.bare is not None or bench.springs:
            write_specimen(path, known.extended(*spring_findings(bench.bare, bench.springs, known)))

    def table(self, points: Sequence[Parameters]) -> str:
        """The bare frame and every spring; and that a block was left clamped, where it was."""
        from protocols.coupling_stiffness.table import springs_table

        told = springs_table([point for point in points if isinstance(point, SpringPoint)])
        return f"{told}\n{STILL_CLAMPED}" if self._bench.clamped else told

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """Every spring beside its label, the decays, and the budget."""
        from bench.report.style import write_figure
        from protocols.coupling_stiffness.figure import springs_figure

        write_figure(path, springs_figure(self._bench.springs))
