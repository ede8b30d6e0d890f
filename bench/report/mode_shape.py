# pyright: reportUnknownMemberType=false
"""One mode drawn on the specimen: frame, spring and block at rest in grey, displaced in black, arrows between.

matplotlib's keyword arguments have no types, hence the first line.
"""

from math import isnan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.style import BLACK, BLUE, GREY, PALE, VERMILLION
from sim.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

REACH = 0.13
"""Greatest displacement in a drawing, over the height of the frame."""

BAY = 0.36
"""Width of the frame, over its height: the model does not have one."""

LIFT = 0.02
"""Height of an arrow above what it belongs to [m]."""

Shape = tuple[float, float, float]
"""u1, u2 (any unit) and theta in rad per that unit, NaN without a block."""


def draw_shape(panel: "Axes", specimen: Specimen, shape: Shape) -> None:
    """Draw a mode, scaled to a displacement that can be seen; x and y are metres, equally long."""
    u1, u2, theta = shape
    frame, block = specimen.frame, specimen.block
    top = 0.0 if isnan(theta) else 2.0 * block.h_b * theta
    scale = REACH * frame.h2 / max(abs(u1), abs(u2), abs(top))
    for factor, colour, width in ((0.0, GREY, 0.8), (scale, BLACK, 1.5)):
        _draw_frame(panel, specimen, factor * u1, factor * u2, colour, width)
        if not isnan(theta):
            _draw_block(panel, specimen, factor * u1, factor * theta, colour, width)
    _arrow(panel, 0.0, frame.h1, scale * u1)
    _arrow(panel, 0.0, frame.h2, scale * u2)
    if not isnan(theta):
        # positive rotation takes the top towards the frame
        _arrow(panel, specimen.d + block.b, 2.0 * block.h_b, -scale * top)
    margin, width = 1.2 * REACH * frame.h2, specimen.d + 2.0 * block.b
    # the bare frame is drawn as large as the coupled one, in the middle
    shift = 0.5 * width if isnan(theta) else 0.0
    left, right = -BAY * frame.h2 - margin - shift, width + margin - shift
    tallest = max(frame.h2, 2.0 * block.h_b)
    panel.plot([left, right], [0.0, 0.0], color=BLACK, linewidth=0.8)
    panel.set_xlim(left, right)
    panel.set_ylim(-0.02 * tallest, 1.1 * tallest)
    panel.set_aspect("equal", anchor="S")
    panel.set_xticks([])
    panel.set_yticks([])
    for side in panel.spines.values():
        side.set_visible(False)


def _draw_frame(panel: "Axes", specimen: Specimen, u1: float, u2: float, colour: str, width: float) -> None:
    """Columns bend as those of a shear frame: clamped at both floors."""
    frame = specimen.frame
    x = np.linspace(0.0, 1.0, 25)
    rise = x * x * (3.0 - 2.0 * x)
    bend = np.concatenate([u1 * rise, u1 + (u2 - u1) * rise])
    height = np.concatenate([frame.h1 * x, frame.h1 + (frame.h2 - frame.h1) * x])
    left = -BAY * frame.h2
    for foot in (left, 0.0):
        panel.plot(foot + bend, height, color=colour, linewidth=width, solid_capstyle="round")
    for shift, level in ((u1, frame.h1), (u2, frame.h2)):
        panel.plot([left + shift, shift], [level, level], color=colour, linewidth=2.0 * width, solid_capstyle="butt")


def _draw_block(panel: "Axes", specimen: Specimen, u1: float, theta: float, colour: str, width: float) -> None:
    """The block turned about the corner that the sign of theta chooses, and the spring to the first storey."""
    block, h1, d = specimen.block, specimen.frame.h1, specimen.d
    left, right = d, d + 2.0 * block.b
    pivot = np.array([left if theta >= 0.0 else right, 0.0])
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])

    def turned(x: float, y: float) -> NDArray[np.float64]:
        return pivot + turn @ (np.array([x, y]) - pivot)

    corners = [(left, 0.0), (right, 0.0), (right, 2.0 * block.h_b), (left, 2.0 * block.h_b)]
    outline = np.array([turned(*corner) for corner in (*corners, corners[0])])
    panel.fill(*outline.T, facecolor=PALE if colour == BLACK else "none", edgecolor=colour, linewidth=width, zorder=1.5)
    start, end = np.array([u1, h1]), turned(left, h1)
    along = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 9), 0.85, 1.0])
    across = np.array([0.0, 0.0, *(0.018 * (-1.0) ** k for k in range(9)), 0.0, 0.0])
    direction = (end - start) / np.hypot(*(end - start))
    normal = np.array([-direction[1], direction[0]])
    coil = start + along[:, None] * (end - start) + across[:, None] * normal
    panel.plot(coil[:, 0], coil[:, 1], color=BLUE if colour == BLACK else GREY, linewidth=0.7 * width)


def _arrow(panel: "Axes", x: float, y: float, length: float) -> None:
    """From the place at rest to the displaced one; nothing where the two can hardly be told apart."""
    if abs(length) > 2e-3:
        panel.annotate(
            "",
            xy=(x + length, y + LIFT),
            xytext=(x, y + LIFT),
            arrowprops={
                "arrowstyle": "-|>",
                "color": VERMILLION,
                "linewidth": 1.2,
                "mutation_scale": 8.0,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
            },
            zorder=5,
        )
