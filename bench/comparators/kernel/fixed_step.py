"""The classical Runge-Kutta method with a fixed step, and the paper's procedure based on it.

Both use the equations of `sim.kernel.equations` and the report array of `sim.kernel.rocking.run`.
"""

from math import ceil, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.equations import COUPLED, GRAVITY, H1, H_B, K_C, MASS, RESTITUTION, B, rates
from sim.kernel.steps import (
    COMPLETED,
    END,
    FAILED,
    IMPACTS,
    LARGEST_STATE,
    OVERTURNED_A,
    OVERTURNED_B,
    PEAKS,
    SAMPLES,
    STATUS,
    STEPS,
)
from sim.kernel.watching import UPLIFT_MARGIN

STAGES = 5
"""Number of rows of a step's scratch space: the rates of the four stages, and the state of a stage."""


@compiled("Tuple((float64, float64))(float64[::1], float64)")
def base(row: NDArray[np.float64], t: float) -> tuple[float, float]:
    """Acceleration [m/s2] and jerk [m/s3] of the base at time `t` [s] from the start of the packed segment `row`."""
    phase = row[5] + t * (row[6] + 0.5 * row[7] * t)
    envelope = row[1] + t * (row[2] + t * (row[3] + t * row[4]))
    growth = row[2] + t * (2.0 * row[3] + 3.0 * t * row[4])
    s = sin(phase)
    rate = growth * s + envelope * (row[6] + row[7] * t) * cos(phase)
    return envelope * s + row[8] + t * row[9], rate + row[9]


@compiled("void(float64[::1], float64, float64[::1], float64, float64[::1], float64[::1])")
def driven_rates(
    p: NDArray[np.float64],
    sg: float,
    row: NDArray[np.float64],
    t: float,
    x: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """`rates` under the base acceleration at time `t` [s] from the start of the packed segment `row`."""
    rates(p, sg, x, base(row, t)[0], out)


@compiled("void(float64[::1], float64, float64[::1], float64, float64, float64, float64, float64[:,::1], float64[::1])")
def rk4(
    p: NDArray[np.float64],
    sg: float,
    x: NDArray[np.float64],
    a0: float,
    a1: float,
    a2: float,
    h: float,
    k: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """One step of the classical Runge-Kutta method (Kutta, 1901), of length `h` [s]. a0, a1 and a2 are the base
    accelerations [m/s2] at its start, middle and end.

    k : scratch space, shape (STAGES, 6); its first row receives the rates at the start.
    """
    rates(p, sg, x, a0, k[0])
    for j in range(6):
        k[4, j] = x[j] + 0.5 * h * k[0, j]
    rates(p, sg, k[4], a1, k[1])
    for j in range(6):
        k[4, j] = x[j] + 0.5 * h * k[1, j]
    rates(p, sg, k[4], a1, k[2])
    for j in range(6):
        k[4, j] = x[j] + h * k[2, j]
    rates(p, sg, k[4], a2, k[3])
    for j in range(6):
        out[j] = x[j] + h / 6.0 * (k[0, j] + 2.0 * (k[1, j] + k[2, j]) + k[3, j])


@compiled("void(float64[::1], float64[::1], float64[::1], float64[::1], float64, float64, float64[::1])")
def between(
    x: NDArray[np.float64],
    slope: NDArray[np.float64],
    following: NDArray[np.float64],
    following_slope: NDArray[np.float64],
    h: float,
    t: float,
    out: NDArray[np.float64],
) -> None:
    """Cubic Hermite interpolation within a step of length `h` [s], at time `t` [s] from its start; its order is 4, like
    that of the method.
    """
    s = t / h
    for j in range(6):
        rise = following[j] - x[j]
        left, right = h * slope[j], h * following_slope[j]
        out[j] = x[j] + s * (left + s * (3.0 * rise - 2.0 * left - right + s * (left + right - 2.0 * rise)))


@compiled("float64(float64, float64, float64, float64, float64, float64)")
def cubic_peak(y: float, slope: float, end: float, end_slope: float, h: float, start: float) -> float:
    """Largest magnitude on [start, h] of the cubic with these values and slopes at 0 and h."""
    a, rise = h * slope, end - y
    b, c = 3.0 * rise - 2.0 * a - h * end_slope, a + h * end_slope - 2.0 * rise
    s = start / h
    best = max(abs(end), abs(y + s * (a + s * (b + s * c))))
    if slope * end_slope < 0.0:
        # the only zero of a + 2 b s + 3 c s^2 between the ends, in the form without cancellation
        root = sqrt(max(0.0, b * b - 3.0 * a * c))
        q = -(b + root) if b >= 0.0 else root - b
        s = q / (3.0 * c) if c != 0.0 else -1.0
        if not (0.0 <= s <= 1.0) and q != 0.0:
            s = a / q
        if start / h <= s <= 1.0:
            best = max(best, abs(y + s * (a + s * (b + s * c))))
    return best


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1], float64, int64, float64, float64,"
    " float64[::1])"
)
def run_paper(
    p: NDArray[np.float64],
    segments: NDArray[np.float64],
    x: NDArray[np.float64],
    sample_times: NDArray[np.float64],
    samples: NDArray[np.float64],
    dt: float,
    parts: int,
    theta_limit: float,
    peaks_from: float,
    report: NDArray[np.float64],
) -> None:
    """Integrate by the procedure of section 3.3 of the paper, unchanged: steps `dt` [s] on one grid, impacts detected
    by theta_{i-1} theta_i < 0.

    parts : 1 for the harmonic procedure, with the impact at the step's end; more for the seismic procedure, which
    repeats the step in this number of parts, with the impact at the end of the part in which the sign changes. The
    other arguments are those of `sim.kernel.rocking.run`. The block lifts when the magnitude of the
    overturning moment at the start of a step exceeds b g M (Eq. 9, A.3), and never returns to rest. Peaks are the
    largest values on the grid; samples are interpolated between grid points.
    """
    following, k, part_slope = np.zeros(6), np.zeros((STAGES, 6)), np.zeros(6)
    peaks = report[PEAKS:]
    peaks[:] = 0.0
    holding = p[B] * p[GRAVITY] * p[MASS]
    duration = segments[:, 0].sum()
    sg = np.sign(x[4]) if x[4] != 0.0 else np.sign(x[5])
    status, impacts, steps, filled, now = COMPLETED, 0, 0, 0, 0.0
    segment, begin = 0, 0.0
    count = ceil(duration / dt - 1e-9)
    a = np.zeros(3)
    for i in range(count):
        origin, length = i * dt, min(dt, duration - i * dt)
        pieces, piece = 1, 0
        while piece < pieces:
            h = length / pieces
            t = origin + piece * h
            # a step may extend over the end of a segment; only its first stage advances the segment permanently
            for stage in range(3):
                place = t + 0.5 * stage * h
                at, at_begin = segment, begin
                while at < segments.shape[0] - 1 and place >= at_begin + segments[at, 0] * (1.0 - 1e-12):
                    at_begin += segments[at, 0]
                    at += 1
                if stage == 0:
                    segment, begin = at, at_begin
                a[stage] = base(segments[at], place - at_begin)[0]
            if sg == 0.0 and p[COUPLED] != 0.0:
                moment = p[H_B] * p[MASS] * a[0] - p[K_C] * p[H1] * x[0]
                if abs(moment) > holding * (1.0 + UPLIFT_MARGIN):
                    sg = np.sign(moment)
            steps += 1
            rk4(p, sg, x, a[0], a[1], a[2], h, k, following)
            crossed = x[4] * following[4] < 0.0
            if crossed and pieces == 1 and parts > 1:
                pieces = parts
                continue
            now = t + h
            if filled < sample_times.size and sample_times[filled] <= now + 1e-12:
                rates(p, sg, following, a[2], part_slope)
                while filled < sample_times.size and sample_times[filled] <= now + 1e-12:
                    between(x, k[0], following, part_slope, h, sample_times[filled] - t, samples[filled])
                    filled += 1
            x[:] = following
            piece += 1
            if crossed:
                impacts += 1
                x[5] *= p[RESTITUTION]
                sg = -sg
            if now >= peaks_from:
                peaks[0] = max(peaks[0], abs(x[0]))
                peaks[1] = max(peaks[1], abs(x[1] - x[0]))
                peaks[2] = max(peaks[2], abs(x[4]))
            if not np.abs(x).max() < LARGEST_STATE:
                status = FAILED
                break
            if abs(x[4]) >= theta_limit:
                status = OVERTURNED_A if x[4] > 0.0 else OVERTURNED_B
                break
        if status != COMPLETED:
            break
    report[STATUS], report[END], report[IMPACTS], report[STEPS], report[SAMPLES] = status, now, impacts, steps, filled
