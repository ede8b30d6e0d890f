# pyright: reportUnknownMemberType=false
"""The identified table over frequency: magnitude, phase, coherence, and what is uncertain about it.

matplotlib's keyword arguments have no types, hence the first line.
"""

from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.control.table_model import TableModel
from bench.report.style import BLACK, BLUE, GREEN, VERMILLION, new_figure, set_grid, ticks_1_2_5

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def response_figure(model: TableModel | None) -> "Figure":
    """Five panels over one axis of frequency; without a model they are empty."""
    figure = new_figure(8.0, 10.5)
    panels = figure.subplots(5, 1, sharex=True, height_ratios=(3, 2, 2, 3, 2))
    magnitude, phase, coherence, doubt, noise = panels
    magnitude.set_ylabel("acceleration per drive\n[m/s2/V]")
    phase.set_ylabel("phase [deg]")
    coherence.set_ylabel("1 - coherence [1]")
    doubt.set_ylabel("of the response\n[m/s2/V]")
    noise.set_ylabel("noise\n[m/s2/Hz^0.5]")
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
    doubt.loglog(f, gain, color=BLUE, label="response")
    doubt.loglog(f, np.array(model.uncertainty), color=BLACK, label="standard uncertainty")
    # a realisation without distortion beyond its noise shows none
    distortion = np.array(model.distortion)
    doubt.loglog(f, np.where(distortion > 0.0, distortion, np.nan), ".", ms=2, color=VERMILLION, label="distortion")
    doubt.legend(loc="best", fontsize=8)
    noise.loglog(f, np.array(model.noise), color=GREEN)
    ticks_1_2_5(noise.xaxis)
    ticks_1_2_5(magnitude.yaxis)
    noise.set_xlim(f[0], f[-1])
    dated = f"{model.date:%Y-%m-%d %H:%M} UTC"
    magnitude.set_title(f"{model.specimen}, {model.level:.3g} m/s2 rms, {dated}", loc="left", fontsize=10)
    return figure
