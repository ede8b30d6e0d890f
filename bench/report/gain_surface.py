# pyright: reportUnknownMemberType=false
"""A gain as a surface over frequency and stiffness, as in Fig. 4(a) of the paper.

matplotlib's keyword arguments have no types, hence the first line.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.report.gain_levels import levels_for
from bench.report.style import BLACK

Floats = NDArray[np.float64]

HEIGHTS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Gains that are written along the height of a surface."""

FLOOR, CEILING = 0.01, 100.0
"""Gains beyond are cut off in the surfaces."""


def draw_surface(panel: Any, omegas: Floats, betas: Floats, gain: Floats) -> None:
    """The gain on a logarithmic height, with a line at unity."""
    from matplotlib.ticker import MaxNLocator

    height = np.log10(np.clip(gain, FLOOR, CEILING))
    x, y = np.meshgrid(omegas, betas)
    panel.plot_surface(
        x,
        y,
        height,
        rstride=max(1, len(betas) // 40),
        cstride=max(1, len(omegas) // 60),
        cmap="cividis",
        linewidth=0.15,
        edgecolor="#00000040",
        antialiased=True,
    )
    panel.contour(x, y, height, levels=[0.0], colors=BLACK, linewidths=1.8, zorder=5)
    panel.view_init(elev=28, azim=-122)
    panel.set_xlabel(r"$\Omega$  [rad/s]", fontsize=8)
    panel.set_ylabel(r"$\beta$", fontsize=8)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MaxNLocator(5))
    panel.tick_params(labelsize=7, pad=1)
    shown = levels_for(10.0**height, HEIGHTS)
    panel.set_zticks(np.log10(shown), [f"{level:g}" for level in shown])
    panel.set_box_aspect((1.3, 1.0, 0.8), zoom=1.05)
