"""The live view of a protocol: its parts, and panels in displayed units with typeset names. Independent of Qt."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.app.display import texts
from bench.app.display.typography import in_screen_unit, typeset
from bench.document.typography import label
from bench.live_view import LiveRun, LiveView, Panel, Style, standard_view
from bench.plugins import plugin_code
from bench.protocol import Protocol
from sim.errors import RockbenchError

LEAST = 1e-3
"""Smallest lower end of an uncertainty interval on a logarithmic axis, relative to the value."""


def live_view(protocol: Protocol[Any], run: LiveRun) -> LiveView:
    """The parts of the live view. If the protocol's function raises an error, a panel with the error is shown instead,
    so that the rest of the display is not affected.
    """
    try:
        with plugin_code(f"the live view of {protocol.name}"):
            return tuple((protocol.view.live or standard_view)(run))
    except RockbenchError as error:
        return (Panel("", awaits=texts.LIVE_FAILED.format(error=error)),)


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve in displayed units, with arrays of shape (n,); `low` and `high` are the ends of its uncertainty
    intervals, None if unknown.
    """

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: Style
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Figure:
    """Curves on common axes; `notice` announces the expected contents, and is empty once there is a result."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    notice: str


def figure_of(panel: Panel) -> Figure:
    """A panel converted to displayed units."""
    (x_name, x_unit), (y_name, y_unit) = panel.x, panel.y
    x_factor, x_shown = in_screen_unit(x_unit)
    y_factor, y_shown = in_screen_unit(y_unit)
    curves: list[Curve] = []
    for curve in panel.curves:
        x, y = x_factor * curve.x, y_factor * curve.y
        low = high = None
        if curve.spread is not None:
            low, high = y - y_factor * curve.spread, y + y_factor * curve.spread
            low = np.maximum(low, LEAST * y) if "y" in panel.logarithmic else low
        curves.append(Curve(label(curve.name), x, y, curve.style, low, high))
    notice = typeset(panel.awaits) if panel.empty else ""
    return Figure(typeset(panel.title), _axis(x_name, x_shown), _axis(y_name, y_shown), tuple(curves), notice)


def _axis(name: str, unit: str) -> str:
    return " ".join(part for part in (label(name), f"[{unit}]" if unit not in ("", "1") else "") if part)
