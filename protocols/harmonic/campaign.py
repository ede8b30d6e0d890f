"""The harmonic campaign as a session takes it: what it checks, predicts, plans and shows."""

from collections.abc import Sequence
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Table
from protocols.harmonic.parameters import HarmonicParameters
from protocols.harmonic.point import HarmonicPoint
from sim.parameters import Parameters


class HarmonicCampaign:
    """Steady-state harmonic tests, bare and coupled (section 4.3 of the paper)."""

    name = "harmonic"
    figure_name = "gain_spectra.png"
    point_type: type[Parameters] = HarmonicPoint

    def __init__(self, parameters: HarmonicParameters) -> None:
        self.parameters = parameters

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for what the table, the lasers or the limits of this bench do not allow."""
        from protocols.harmonic.reach import check_storeys, check_table

        check_table(self.parameters, configuration)
        check_storeys(self.parameters, configuration)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """Every stage of the drive, and the most that is asked of every limited quantity; plans the starts."""
        from protocols.harmonic.preflight import forecast

        return forecast(self.parameters, configuration, progress)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """Gain spectra of every spring on both layers, wide enough to frame the measured points."""
        from protocols.harmonic.prediction import gain_spectra

        return gain_spectra(self.parameters, configuration.known_specimen, configuration.known_on_table)

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
