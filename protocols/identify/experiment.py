"""The identification on a bench: its level and demands, its plan, and the response in thirds of an octave."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import ceil, degrees, floor, log2

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.engine.steps import Say
from bench.events import PointFinished
from bench.preflight.asked import UNKNOWN_SHAKER
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from bench.report.text_table import TextColumn, text_table
from protocols.common.identification.level import planned
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.plan import expected_duration, identified
from protocols.identify.figure import response_figure
from protocols.identify.protocol import IdentifiedBand
from sim.parameters import Parameters

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: the probes find out, within limits.drive_voltage",
    "drive_slew": "nothing is known of this table: the probes find out, within limits.drive_slew",
    **UNKNOWN_SHAKER,
}


class Identification(Prepared[IdentifyParameters]):
    """The table's response to its drive, as a file that other runs load. Refuses a band that this bench cannot make."""

    def __init__(
        self, parameters: IdentifyParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._found = planned(parameters, configuration)
        self._model: TableModel | None = None

    @cached_property
    def forecast(self) -> Forecast:
        """The demands of the strongest multisine: its motions are known beforehand, and linear."""
        self.progress("predicting what the run asks of the bench")
        found = self._found
        where = f"a multisine of {found.level:.3g} m/s2"
        demands = [
            Demand(quantity, found.asked[quantity], None, where)
            if quantity in found.asked
            else Demand(quantity, None, None, _UNKNOWN[quantity])
            for quantity in bounds(self.configuration)
        ]
        return Forecast(demands=tuple(demands), duration=expected_duration(self.parameters, found))

    @cached_property
    def prediction(self) -> Table:
        """The motion that is wanted of the table, line by line."""
        peak = np.abs(self._found.motions[0])
        return {
            "frequency": Column(self._found.grid.frequency, "Hz", "lines of the multisines"),
            "acceleration": Column(peak, "m/s2", "amplitude of the table's acceleration that is asked for"),
        }

    def plan(self) -> Plan:
        self._model = None
        self._model = yield from identified(self.parameters, self.configuration, self._found)
        points = list(thirds(self._model))
        for point in points:
            yield Say(PointFinished(point))
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        model = self._model
        return Result(
            points=tuple(points),
            text=_table([point for point in points if isinstance(point, IdentifiedBand)]),
            figures={"table_response.png": lambda path: write_figure(path, response_figure(model))},
            files={} if model is None else {"table_model.json": model.write},
        )


def thirds(model: TableModel) -> Iterator[IdentifiedBand]:
    """The model in thirds of an octave around 1 Hz times powers of 2^(1/3); those without a line are left out."""
    frequency = np.array(model.frequency)
    response = np.array(model.real) + 1j * np.array(model.imaginary)
    low, high = model.band
    for number in range(floor(3.0 * log2(low)), ceil(3.0 * log2(high)) + 1):
        middle = 2.0 ** (number / 3.0)
        inside = (frequency >= middle * 2.0 ** (-1.0 / 6.0)) & (frequency < middle * 2.0 ** (1.0 / 6.0))
        if not inside.any():
            continue
        gain = _rms(np.abs(response[inside]))
        nearest = int(np.argmin(np.abs(frequency - middle)))
        yield IdentifiedBand(
            frequency_hz=middle,
            gain_m_s2_v=gain,
            phase_rad=float(np.angle(response[nearest])),
            uncertainty=COVERAGE * _rms(np.array(model.uncertainty)[inside]) / gain,
            distortion=_rms(np.array(model.distortion)[inside]) / gain,
            noise_m_s2_hz=_rms(np.array(model.noise)[inside]),
            coherence=float(np.array(model.coherence)[inside].min()),
            lines=int(np.count_nonzero(inside)),
        )


def _rms(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))


_COLUMNS = (
    TextColumn("frequency", "Hz"),
    TextColumn("gain", "m/s2/V"),
    TextColumn("phase", "deg"),
    TextColumn("U (k=2)", "%"),
    TextColumn("distortion", "%"),
    TextColumn("noise", "m/s2/Hz^0.5"),
    TextColumn("coherence", "1"),
    TextColumn("lines", "1"),
)


def _table(points: Sequence[IdentifiedBand]) -> str:
    """One row for each third of an octave."""
    if not points:
        return "Nothing was identified."
    return text_table(_COLUMNS, map(_cells, points))


def _cells(point: IdentifiedBand) -> tuple[str, ...]:
    return (
        f"{point.frequency_hz:.3g}",
        f"{point.gain_m_s2_v:.4g}",
        f"{degrees(point.phase_rad):.1f}",
        f"{100.0 * point.uncertainty:.2g}",
        f"{100.0 * point.distortion:.2g}",
        f"{point.noise_m_s2_hz:.2g}",
        f"{point.coherence:.5f}",
        f"{point.lines}",
    )
