# pyright: reportUnknownMemberType=false
"""The lasers' errors over their readings, what is found without each pass, and the orders that were tried.

matplotlib's keyword arguments have no types, hence the first line.
"""

from typing import TYPE_CHECKING

import numpy as np

from bench.report.style import BLACK, BLUE, GREY, new_figure, set_grid
from protocols.laser_calibration.fit import Fitted

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def errors_figure(curves: tuple[Fitted, Fitted] | None) -> "Figure":
    """Two panels for each laser; without curves they are empty."""
    figure = new_figure(9.0, 6.5)
    panels = figure.subplots(2, 2, width_ratios=(3, 1), squeeze=False)
    for number, (over, orders) in enumerate(panels, 1):
        over.set_title(f"laser {number}", loc="left", fontsize=10)
        over.set_xlabel("reading [mm]")
        over.set_ylabel("reading minus displacement [um]")
        orders.set_xlabel("order [1]")
        orders.set_ylabel("foretold wrongly [um]")
        set_grid(over)
        set_grid(orders)
        if curves is None:
            continue
        curve = curves[number - 1]
        at = np.linspace(-1.0, 1.0, curve.without.shape[1])
        reading = 1e3 * np.linspace(curve.low, curve.high, at.size)
        for each in curve.without:
            over.plot(reading, 1e6 * (each - each.mean()), color=GREY, linewidth=0.6)
        error = np.polynomial.chebyshev.chebval(at, curve.error)
        over.plot(reading, 1e6 * (error - error.mean()), color=BLUE)
        tried = np.arange(1, curve.scores.size + 1)
        orders.semilogy(tried, 1e6 * curve.scores, "o-", color=BLACK, markersize=4)
        orders.axvline(curve.error.size - 1, color=BLUE)
    return figure
