"""Live view of the laser calibration: error of each laser over its range, and its change if any one pass is
omitted.
"""

import numpy as np

from bench.live_view import LiveRun, LiveView, Panel

LASERS = ("laser_1", "laser_2")


def error_view(run: LiveRun) -> LiveView:
    """Error of both lasers [um], and the change of each error when one of the passes is omitted."""
    errors = Panel(
        "error over the range",
        ("reading", "m"),
        ("error", "um"),
        awaits="The errors of both lasers appear here when all passes have been evaluated.",
    )
    residuals = Panel(
        "residuals",
        ("reading", "m"),
        ("change without one pass", "um"),
        awaits="The change of each error when one of the passes is omitted appears here.",
    )
    found = {fit.name: fit.columns for fit in run.fits}
    for laser in LASERS:
        if (columns := found.get(f"error of {laser}")) is None:
            continue
        reading, error = columns["reading"].values, columns["error"].values
        errors.line(laser, reading, 1e6 * error)
        without = [series.values - error for name, series in columns.items() if name.startswith("without_")]
        # NaN separates the passes
        passes = [np.append(each, np.nan) for each in without]
        residuals.line(laser, np.tile(np.append(reading, np.nan), len(passes)), 1e6 * np.concatenate(passes))
    return errors, residuals
