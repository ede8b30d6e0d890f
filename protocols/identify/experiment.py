"""The identification as a session takes it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Column, Table
from protocols.identify.parameters import IdentifyParameters
from protocols.identify.point import IdentifiedBand
from sim.parameters import Parameters


class Identification:
    """The table's response to its drive, as a file that other runs load."""

    name = "identify"
    figure_name = "table_response.png"
    kept_name = "table_model.json"
    point_type: type[Parameters] = IdentifiedBand

    def __init__(self, parameters: IdentifyParameters) -> None:
        self.parameters = parameters
        self._model: TableModel | None = None

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for a band that this bench cannot make."""
        from protocols.identify.level import planned

        planned(self.parameters, configuration)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """The most that is asked of every limited quantity."""
        from protocols.identify.preflight import forecast

        progress("predicting what the run asks of the bench")
        return forecast(self.parameters, configuration)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """The motion that is wanted of the table, line by line."""
        from protocols.identify.level import planned

        found = planned(self.parameters, configuration)
        peak = np.abs(found.motions[0])
        return {
            "frequency": Column(found.grid.frequency, "Hz", "lines of the multisines"),
            "acceleration": Column(peak, "m/s2", "amplitude of the table's acceleration that is asked for"),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.identify.sheet import identify_plan

        def keep(model: TableModel) -> None:
            self._model = model

        return identify_plan(self.parameters, configuration, keep)

    def keep(self, path: Path) -> None:
        """Write the identified table for other runs, if it was identified."""
        if self._model is not None:
            self._model.write(path)

    def table(self, points: Sequence[Parameters]) -> str:
        """The response in thirds of an octave."""
        from protocols.identify.table import bands_table

        return bands_table([point for point in points if isinstance(point, IdentifiedBand)])

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """Every line of the response, and what is uncertain about it."""
        from bench.report.style import write_figure
        from protocols.identify.figure import response_figure

        write_figure(path, response_figure(self._model))
