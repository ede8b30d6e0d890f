"""The harmonic campaign as a session takes it: what it checks, predicts, plans and shows."""

from collections.abc import Sequence
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.record.tables import Table
from protocols.harmonic.parameters import HarmonicParameters
from protocols.harmonic.point import HarmonicPoint
from sim.errors import InvalidInput
from sim.parameters import Parameters


class HarmonicCampaign:
    """Steady-state harmonic tests, bare and coupled (section 4.3 of the paper)."""

    name = "harmonic"
    point_type: type[Parameters] = HarmonicPoint

    def __init__(self, parameters: HarmonicParameters) -> None:
        self.parameters = parameters

    def check(self, configuration: BenchConfiguration) -> None:
        """Refuse motions beyond the guard's limits or the shaker's stroke: x = a / Omega^2, v = a / Omega."""
        limits, stroke = configuration.limits, configuration.simulation.bench.shaker.half_stroke
        amplitude = self.parameters.amplitude_factor * configuration.specimen.uplift_acceleration
        if amplitude > limits.acceleration:
            allowed = f"it asks for {amplitude:.3g} m/s2 where limits.acceleration = {limits.acceleration:g} m/s2"
            raise InvalidInput("amplitude_factor", self.parameters.amplitude_factor, allowed)
        reach, owner = min((stroke, "the shaker's stroke"), (limits.displacement, "limits.displacement"))
        for omega in self.parameters.omega:
            travel, speed = amplitude / omega**2, amplitude / omega
            if travel > reach:
                needs = f"{amplitude:.3g} m/s2 needs {1e3 * travel:.1f} mm there, {owner} allows {1e3 * reach:.1f} mm"
                raise InvalidInput("omega", omega, needs)
            if speed > limits.velocity:
                needs = f"{amplitude:.3g} m/s2 needs {speed:.3g} m/s there, limits.velocity = {limits.velocity:g} m/s"
                raise InvalidInput("omega", omega, needs)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """Gain spectra of every spring on both layers, wide enough to frame the measured points."""
        from protocols.harmonic.prediction import gain_spectra

        return gain_spectra(self.parameters, configuration.specimen)

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.harmonic.sheet import HarmonicSheet

        return HarmonicSheet(self.parameters, configuration).plan()

    def table(self, points: Sequence[Parameters]) -> str:
        """The points as plain text."""
        from bench.report.table import points_table

        return points_table(points)

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:
        """Gain spectra like the paper's Fig. 6."""
        from bench.report.figure import gain_spectra, write_figure

        columns = {name: column.values for name, column in prediction.items()}
        write_figure(path, gain_spectra(points, columns))
