"""The seismic campaign as a session takes it: what it checks, predicts, plans and shows."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Table
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.point import EarthquakePoint
from sim.parameters import Parameters

if TYPE_CHECKING:
    from protocols.earthquake.sources import Sources


class EarthquakeCampaign:
    """Earthquake records on the frame, bare and coupled (section 5 of the paper)."""

    name = "earthquake"
    figure_name = "gain_curves.png"
    further_figures = ("table_motions.png", "drift_histories.png")
    point_type: type[Parameters] = EarthquakePoint

    def __init__(self, parameters: EarthquakeParameters) -> None:
        from protocols.earthquake.histories import Histories

        self.parameters = parameters
        self._histories = Histories()
        self._records: list[dict[str, object]] = []
        self._band = (0.0, 0.0)
        self._sources: Sources | None = None

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for records, a band or a table model that cannot be used on this bench."""
        from protocols.earthquake.check import check

        check(self.parameters, configuration, self._sources)

    def sources(self, configuration: BenchConfiguration) -> Mapping[str, Table]:
        """The records and the table model that are read from files."""
        from protocols.earthquake.records import shakings
        from protocols.earthquake.sources import Sources
        from protocols.earthquake.table import stored_table

        records = tuple(shaking.accelerogram for shaking in shakings(self.parameters, configuration, self._sources))
        return Sources(records, stored_table(self.parameters, configuration, self._sources)).tables

    def restore(self, tables: Mapping[str, Table]) -> None:
        """Take them from the tables of a data file from now on."""
        from protocols.earthquake.sources import Sources

        self._sources = Sources.stored(tables)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """Every record with every specimen: the most that is asked of every limit, and the chance that it stands."""
        from protocols.earthquake.preflight import forecast

        return forecast(self.parameters, configuration, progress)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """Gain curves of every record under the asked motion."""
        from protocols.earthquake.prediction import gain_curves

        return gain_curves(self.parameters, configuration)

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.earthquake.records import band_used, shakings
        from protocols.earthquake.sheet import EarthquakeSheet

        self._band = band_used(self.parameters, configuration)
        found = shakings(self.parameters, configuration, self._sources)
        self._records = [shaking.described() for shaking in found]
        return EarthquakeSheet(self.parameters, configuration, self._histories, self._sources).plan()

    def table(self, points: Sequence[Parameters]) -> str:
        """The points and the paper's statement as plain text."""
        from protocols.earthquake.statement import check_statement, statement_text
        from protocols.earthquake.text import earthquake_table

        return f"{earthquake_table(points)}\n\n{statement_text(check_statement(points, self._band))}"

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:
        """Gain curves like the paper's Fig. 8(a) and 9(a)."""
        from bench.report.earthquake_gains import gain_figure
        from bench.report.style import write_figure

        columns = {name: column.values for name, column in prediction.items()}
        write_figure(path, gain_figure(points, columns))

    def draw_further(self, folder: Path) -> None:
        """The table's motions like Fig. 7, and the drift's histories like Fig. 8(b) and 9(b)."""
        from bench.report.earthquake_histories import DriftPicture, MotionPicture, drift_figure, motion_figure
        from bench.report.style import write_figure
        from protocols.earthquake.live import STEP

        kept = self._histories
        motions = [MotionPicture(name, STEP, asked, kept.achieved[name]) for name, asked in kept.asked.items()]
        drifts = [
            DriftPicture(name, beta, STEP, each.measured, each.predicted) for (name, beta), each in kept.drifts.items()
        ]
        write_figure(folder / self.further_figures[0], motion_figure(motions))
        write_figure(folder / self.further_figures[1], drift_figure(drifts))

    def findings(self, points: Sequence[Parameters]) -> Mapping[str, object]:
        """The records as they were used, and the paper's statement."""
        from protocols.earthquake.statement import check_statement

        return {"records": self._records, "statement": check_statement(points, self._band)}
