# pyright: reportUnknownMemberType=false
"""Figure of a hold: peak drift and control in each cycle, including those after the release."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.figures.style import BLUE, GREY, MILLI, VERMILLION, new_figure, set_grid, ticks_1_2_5

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 7.5, 4.6
"""Size of the figure [inches]."""


def hold_figure(cycles: Mapping[str, Sequence[Any]], omega: float, beta: float) -> "Figure":
    """Peak drift (above) and control (below) of each cycle of the last hold at `omega` [rad/s] and `beta`.

    `cycles` are the columns of `protocols.common.sine.holding.HoldCycle`.
    """
    here = [k for k, at in enumerate(zip(cycles["omega"], cycles["beta"], strict=True)) if at == (omega, beta)]
    # a hold after a further start counts its cycles from 1 again
    begin = max((k for k, row in enumerate(here) if cycles["cycle"][row] == 1), default=0)
    here = here[begin:]
    number, drift, control = (np.array([cycles[name][k] for k in here]) for name in ("cycle", "drift_peak", "control"))
    figure = new_figure(WIDTH, HEIGHT)
    above, below = figure.add_subplot(2, 1, 1), figure.add_subplot(2, 1, 2)
    above.semilogy(number, MILLI * drift, "o", color=BLUE, markersize=2.5)
    ticks_1_2_5(above.yaxis)
    above.set_ylabel("peak drift  [mm]")
    above.set_title(rf"$\Omega$ = {omega:g} rad/s,  $\beta$ = {beta:g}", loc="left", fontsize=9)
    # a logarithmic axis has no zero, so cycles without control are not drawn
    below.semilogy(number, 100.0 * np.where(control > 0.0, control, np.nan), "o", color=VERMILLION, markersize=2.5)
    below.set_ylabel("control  [% of amplitude]")
    below.set_xlabel("cycle of the hold")
    controlled = np.flatnonzero(control > 0.0)
    for panel in (above, below):
        set_grid(panel)
        panel.set_xlim(0.0, float(number[-1]) + 1.0)
        if controlled.size and controlled[-1] + 1 < number.size:
            panel.axvline(float(number[controlled[-1]]) + 0.5, color=GREY, linewidth=1.0, linestyle="--")
    if controlled.size and controlled[-1] + 1 < number.size:
        above.annotate(" released", (float(number[controlled[-1]]), MILLI * float(np.nanmax(drift))), fontsize=8)
    return figure
