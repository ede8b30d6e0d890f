"""The simple fit: a zero-phase high-pass whose corner is as low as stroke and velocity allow."""

from dataclasses import dataclass

import numpy as np

from bench.analysis.table_motion import Array, at_rest_in_the_end, table_motion
from bench.control.stroke.reach import Reach
from sim.errors import InvalidInput

ORDER = 2
"""Order n of the Butterworth filter that runs forward and backward: gain 1 / (1 + (f_c / f)^2n), no phase."""

CORNERS = (0.005, 5.0)
"""Corners between which the lowest that fits is sought [Hz]."""

HALVINGS = 24
"""Of that interval, on a logarithmic scale: it ends a millionth wide."""

PAD = 1.5
"""Zeros put before and after, in periods of the corner and for each order: where the filter's answer dies away."""


@dataclass(frozen=True, eq=False)
class HighPassed:
    """The filtered record [m/s2], the zeros put in front of it in samples, and the corner [Hz]."""

    acceleration: Array
    lead: int
    corner: float


def fit_by_high_pass(acceleration: Array, dt: float, reach: Reach) -> HighPassed:
    """`acceleration` [m/s2], shape (n,), through the high-pass with the lowest corner that keeps the table in `reach`.

    Raises InvalidInput where no corner up to 5 Hz does.
    """
    low, high = CORNERS
    found = high_passed(acceleration, dt, high)
    motion = table_motion(found.acceleration, dt)
    if not reach.holds(motion):
        needs = f"even above {high:g} Hz it needs {1e3 * motion.peak_displacement:.3g} mm and"
        allowed = f"{1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s are allowed: scale it down"
        raise InvalidInput("record", "", f"{needs} {motion.peak_velocity:.3g} m/s; {allowed}")
    for _ in range(HALVINGS):
        corner = (low * high) ** 0.5
        tried = high_passed(acceleration, dt, corner)
        if reach.holds(table_motion(tried.acceleration, dt)):
            found, high = tried, corner
        else:
            low = corner
    return found


def high_passed(acceleration: Array, dt: float, corner: float) -> HighPassed:
    """`acceleration` without what is below `corner` [Hz], ending at rest, with room before and after for the filter."""
    lead = int(np.ceil(PAD * ORDER / (corner * dt)))
    padded = np.pad(acceleration, lead)
    # as many zeros again keep the ends of the periodic transform from reaching into one another
    length = 2 * padded.size
    frequencies = np.fft.rfftfreq(length, dt)
    gain = np.zeros_like(frequencies)
    gain[1:] = 1.0 / (1.0 + (corner / frequencies[1:]) ** (2 * ORDER))
    filtered = np.fft.irfft(np.fft.rfft(padded, length) * gain, length)[: padded.size]
    return HighPassed(at_rest_in_the_end(filtered, dt), lead, corner)
