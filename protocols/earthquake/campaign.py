"""The seismic campaign on a bench (section 5 of the paper): records, table, forecast, predicted curves and result."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.preflight.forecast import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Table, arrays
from bench.report.earthquake_gains import gain_figure
from bench.report.earthquake_histories import DriftPicture, MotionPicture, drift_figure, motion_figure
from bench.report.style import write_figure
from protocols.earthquake.forecast import forecast
from protocols.earthquake.histories import Histories
from protocols.earthquake.live import STEP
from protocols.earthquake.prediction import Curves, curves, gain_curves
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import band_used, shakings
from protocols.earthquake.sheet import EarthquakeSheet
from protocols.earthquake.sources import FileSources
from protocols.earthquake.statement import check_statement, statement_text
from protocols.earthquake.table import TableSource
from protocols.earthquake.text import earthquake_table
from sim.parameters import Parameters


class EarthquakeCampaign(Prepared[EarthquakeParameters]):
    """Reads and prepares the records. Refuses records, a band or a table model that cannot be used on this bench."""

    def __init__(
        self, parameters: EarthquakeParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        kept = None if stored is None else FileSources.stored(stored)
        self.table = TableSource.of(parameters, configuration, kept)
        self.shakings = shakings(parameters, configuration, kept)
        self._histories = Histories()

    @cached_property
    def curves(self) -> Curves:
        """The predicted gains under the asked motions."""
        return curves(self.parameters, self.shakings, self.configuration.known_specimen)

    @cached_property
    def forecast(self) -> Forecast:
        return forecast(self.parameters, self.configuration, self.shakings, self.table, self.progress)

    @cached_property
    def prediction(self) -> Table:
        return gain_curves(self.curves)

    @cached_property
    def sources(self) -> Sources:
        """The records and the table model that are read from files."""
        return FileSources(tuple(shaking.accelerogram for shaking in self.shakings), self.table.model).tables

    def plan(self) -> Plan:
        kept = self._histories = Histories()
        sheet = EarthquakeSheet(self.parameters, self.configuration, self.shakings, self.table, self.curves, kept)
        return self.collected(sheet.plan())

    def result(self, points: Sequence[Parameters]) -> Result:
        kept = self._histories
        statement = check_statement(points, band_used(self.parameters, self.configuration))

        def gains(path: Path) -> None:
            write_figure(path, gain_figure(points, arrays(self.prediction)))

        def motions(path: Path) -> None:
            asked = kept.asked.items()
            write_figure(path, motion_figure([MotionPicture(name, STEP, a, kept.achieved[name]) for name, a in asked]))

        def drifts(path: Path) -> None:
            shown = [
                DriftPicture(name, beta, STEP, each.measured, each.predicted)
                for (name, beta), each in kept.drifts.items()
            ]
            write_figure(path, drift_figure(shown))

        return Result(
            points=tuple(points),
            text=f"{earthquake_table(points)}\n\n{statement_text(statement)}",
            figures={"gain_curves.png": gains, "table_motions.png": motions, "drift_histories.png": drifts},
            findings={"records": [shaking.described() for shaking in self.shakings], "statement": statement},
        )
