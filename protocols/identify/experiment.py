# pyright: reportUnknownMemberType=false
"""Identification of the table: level and demands, plan, and response in third-octave bands with its figure."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import ceil, degrees, floor, log2
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.datafile.tables import Column, Table
from bench.engine.steps import Publish
from bench.events import PointFinished
from bench.figures.style import BLACK, BLUE, GREEN, VERMILLION, new_figure, set_grid, ticks_1_2_5, write_figure
from bench.figures.text_table import TextColumn, text_table
from bench.preflight.demands import demands_of
from bench.preflight.margins import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.plan import expected_duration, identified
from protocols.common.identification.signal import planned
from protocols.identify.protocol import IdentifiedBand
from sim.parameters import Parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Identification(Prepared[IdentifyParameters]):
    """Identification of the table's response to its drive; the result is written to a file for other runs.

    Raises InvalidInput for a band that the bench cannot produce.
    """

    def __init__(
        self, parameters: IdentifyParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._found = planned(parameters, configuration)
        self._model: TableModel | None = None

    @cached_property
    def forecast(self) -> Forecast:
        """Largest demands of the planned multisines."""
        self.progress("predicting the demands of the run")
        found = self._found
        where = f"a multisine with a peak of {found.level:.3g} m/s2"
        demands = demands_of(found.demands, where, self.configuration)
        return Forecast(demands=demands, duration=expected_duration(self.parameters, found))

    @cached_property
    def prediction(self) -> Table:
        """Requested acceleration amplitude of the table at each line of the first multisine."""
        peak = np.abs(self._found.motions[0])
        return {
            "frequency": Column(self._found.grid.frequency, "Hz", "lines of the multisines"),
            "acceleration": Column(peak, "m/s2", "requested amplitude of the table's acceleration"),
        }

    def plan(self) -> Plan:
        self._model = None
        self._model = yield from identified(self.parameters, self.configuration, self._found)
        points = list(thirds(self._model))
        for point in points:
            yield Publish(PointFinished(point))
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        model = self._model
        return Result(
            points=tuple(points),
            text=_table([point for point in points if isinstance(point, IdentifiedBand)]),
            figures={"table_response.png": lambda path: write_figure(path, _response_figure(model))},
            files={} if model is None else {"table_model.json": model.write},
        )


def thirds(model: TableModel) -> Iterator[IdentifiedBand]:
    """Third-octave bands of the table model, centred at 1 Hz times powers of 2^(1/3); empty bands are omitted."""
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
    """Text table with a row for each third-octave band."""
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


def _response_figure(model: TableModel | None) -> "Figure":
    """Figure of five panels against frequency, empty without a model."""
    figure = new_figure(8.0, 10.5)
    panels = figure.subplots(5, 1, sharex=True, height_ratios=(3, 2, 2, 3, 2))
    magnitude, phase, coherence, uncertain, noise = panels
    magnitude.set_ylabel("acceleration per drive\n[m/s²/V]")
    phase.set_ylabel("phase [°]")
    coherence.set_ylabel("1 − coherence [1]")
    uncertain.set_ylabel("response, errors\n[m/s²/V]")
    noise.set_ylabel("noise\n[m/s²/√Hz]")
    noise.set_xlabel("frequency [Hz]")
    for panel in panels:
        set_grid(panel)
    if model is None:
        magnitude.set_title("nothing was identified", loc="left")
        return figure
    f = np.array(model.frequency)
    response = np.array(model.real) + 1j * np.array(model.imaginary)
    gain, spread = np.abs(response), COVERAGE * np.array(model.uncertainty)
    magnitude.fill_between(f, np.maximum(gain - spread, 1e-3 * gain), gain + spread, color=BLUE, alpha=0.3, linewidth=0)
    magnitude.loglog(f, gain, color=BLUE)
    phase.plot(f, np.degrees(np.unwrap(np.angle(response))), color=BLUE)
    coherence.semilogy(f, np.maximum(1.0 - np.array(model.coherence), 1e-12), color=BLUE)
    uncertain.loglog(f, gain, color=BLUE, label="response")
    uncertain.loglog(f, np.array(model.uncertainty), color=BLACK, label="standard uncertainty")
    # distortion that does not exceed the noise is not drawn
    distortion = np.array(model.distortion)
    uncertain.loglog(f, np.where(distortion > 0.0, distortion, np.nan), ".", ms=2, color=VERMILLION, label="distortion")
    uncertain.legend(loc="best", fontsize=8)
    noise.loglog(f, np.array(model.noise), color=GREEN)
    ticks_1_2_5(noise.xaxis)
    ticks_1_2_5(magnitude.yaxis)
    noise.set_xlim(f[0], f[-1])
    dated = f"{model.date:%Y-%m-%d %H:%M} UTC"
    magnitude.set_title(f"{model.specimen}, {model.level:.3g} m/s² rms, {dated}", loc="left", fontsize=10)
    return figure
