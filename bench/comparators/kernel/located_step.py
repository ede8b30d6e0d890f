"""The classical Runge-Kutta method with a fixed step and events located to the order of the method.

An event is located not by interpolation but by trial steps of other lengths from the same state, which preserves order
4. The method uses the equations of `sim.kernel.equations` and the report array of `sim.kernel.rocking.run`.
"""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from bench.comparators.kernel.fixed_step import STAGES, base, between, cubic_peak, rk4
from sim.kernel.compiled import compiled
from sim.kernel.equations import COUPLED, GRAVITY, H1, H_B, INERTIA, K_C, MASS, RESTITUTION, B, rates
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
from sim.kernel.watching import IMPACT, NO_EVENT, OVERTURNING, UPLIFT, UPLIFT_MARGIN


@compiled("Tuple((float64, float64))(float64[::1], int64, float64, float64, float64[::1], float64, float64[::1])")
def distance(
    p: NDArray[np.float64],
    event: int,
    sg: float,
    theta_limit: float,
    row: NDArray[np.float64],
    t: float,
    x: NDArray[np.float64],
) -> tuple[float, float]:
    """Distance of the state `x` at time `t` [s] of a segment from `event`, positive before it; its time derivative."""
    if event == IMPACT:
        return sg * x[4], sg * x[5]
    if event == OVERTURNING:
        return theta_limit - sg * x[4], -sg * x[5]
    a, rate = base(row, t)
    moment = p[H_B] * p[MASS] * a - p[K_C] * p[H1] * x[0]
    growth = p[H_B] * p[MASS] * rate - p[K_C] * p[H1] * x[2]
    return p[B] * p[GRAVITY] * p[MASS] * (1.0 + UPLIFT_MARGIN) - abs(moment), -np.sign(moment) * growth


@compiled(
    "float64(float64[::1], int64, float64, float64, float64[::1], float64[::1], float64, int64, float64, float64,"
    " boolean, float64[:,::1], float64[::1])"
)
def located(
    p: NDArray[np.float64],
    event: int,
    sg: float,
    theta_limit: float,
    row: NDArray[np.float64],
    x: NDArray[np.float64],
    tau: float,
    known: int,
    first: float,
    h: float,
    turning: bool,
    k: NDArray[np.float64],
    out: NDArray[np.float64],
) -> float:
    """Length in (0, h] of the step that ends at `event` or, with `turning`, where the distance to the event is
    smallest.

    Every trial is a whole Runge-Kutta step from `x` to `out`. The `known` roots theta = 0 at the start are divided out:
    the method finds a zero of distance / t^known over the length t of the step; at t = 0 it is `first`. Method: false
    position with the halving of Dowell and Jarratt (1971).
    """
    a0, side = base(row, tau)[0], 0
    low, high, below, above = 0.0, h, first, 0.0
    t = h
    for _ in range(80):
        rk4(p, sg, x, a0, base(row, tau + 0.5 * t)[0], base(row, tau + t)[0], t, k, out)
        value, slope = distance(p, event, sg, theta_limit, row, tau + t, out)
        found = -slope if turning else value / t**known
        if found > 0.0:
            low, below = t, found
            above = 0.5 * above if side == 1 else above
            side = 1
        else:
            high, above = t, found
            below = 0.5 * below if side == -1 else below
            side = -1
        if found == 0.0 or not high - low > 4e-16 * h:
            break
        t = (low * above - high * below) / (above - below) if above < below else 0.5 * (low + high)
        if not low < t < high:
            t = 0.5 * (low + high)
        if not low < t < high:
            break
    return high


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1], float64, float64, float64, float64,"
    " int64, float64[::1])"
)
def run_located(
    p: NDArray[np.float64],
    segments: NDArray[np.float64],
    x: NDArray[np.float64],
    sample_times: NDArray[np.float64],
    samples: NDArray[np.float64],
    dt: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: float,
    most_impacts: int,
    report: NDArray[np.float64],
) -> None:
    """Integrate with steps of at most `dt` that end at segment ends and events: order 4 across both.

    The arguments and the criterion for rest are those of `sim.kernel.rocking.run`; the run fails after `most_impacts`
    impacts. A block that touches the ground within a step is detected if the distance falls at the step's start and
    rises at its end.
    """
    following, k, slope = np.zeros(6), np.zeros((STAGES, 6)), np.zeros(6)
    peaks = report[PEAKS:]
    peaks[:] = 0.0
    holding = p[B] * p[GRAVITY] * p[MASS]
    sg = np.sign(x[4]) if x[4] != 0.0 else np.sign(x[5])
    status, impacts, steps, filled = COMPLETED, 0, 0, 0
    begin = now = lost = 0.0
    known = 1 if x[4] == 0.0 else 0
    for i in range(segments.shape[0]):
        row = segments[i]
        tau = 0.0
        while row[0] - tau > 1e-14 * row[0]:
            a = base(row, tau)[0]
            moment = p[H_B] * p[MASS] * a - p[K_C] * p[H1] * x[0]
            if sg == 0.0 and p[COUPLED] != 0.0 and abs(moment) > holding * (1.0 + UPLIFT_MARGIN):
                sg, known = np.sign(moment), 2
            remaining = row[0] - tau
            parts = ceil(remaining / dt - 1e-9)
            h = remaining / parts
            rk4(p, sg, x, a, base(row, tau + 0.5 * h)[0], base(row, tau + h)[0], h, k, following)
            event = NO_EVENT
            for candidate in range(2 if sg != 0.0 else int(p[COUPLED])):
                kind = UPLIFT if sg == 0.0 else (IMPACT if candidate == 0 else OVERTURNING)
                gap, falling = distance(p, kind, sg, theta_limit, row, tau, x)
                gap_end, rising = distance(p, kind, sg, theta_limit, row, tau + h, following)
                roots, reach = (known if kind == IMPACT else 0), h
                if gap_end > 0.0 and falling < 0.0 and rising > 0.0:
                    reach = located(p, kind, sg, theta_limit, row, x, tau, 0, -falling, h, True, k, following)
                    gap_end = distance(p, kind, sg, theta_limit, row, tau + reach, following)[0]
                if gap_end <= 0.0:
                    first = gap if roots == 0 else (falling if roots == 1 else 0.5 * sg * k[0, 5])
                    h = located(p, kind, sg, theta_limit, row, x, tau, roots, first, reach, False, k, following)
                    event = kind
                if event != NO_EVENT or reach != h:
                    rk4(p, sg, x, a, base(row, tau + 0.5 * h)[0], base(row, tau + h)[0], h, k, following)
                if event != NO_EVENT:
                    break
            steps += 1
            if not np.abs(following).max() < LARGEST_STATE:
                status = FAILED
                break
            if filled < sample_times.size and sample_times[filled] <= now + h + 1e-12:
                rates(p, sg, following, base(row, tau + h)[0], slope)
                while filled < sample_times.size and sample_times[filled] <= now + h + 1e-12:
                    between(x, k[0], following, slope, h, sample_times[filled] - now, samples[filled])
                    filled += 1
            if now + h > peaks_from:
                start = max(0.0, peaks_from - now)
                u1 = cubic_peak(x[0], x[2], following[0], following[2], h, start)
                peaks[0] = max(peaks[0], u1)
                ends = x[1] - x[0], x[3] - x[2], following[1] - following[0], following[3] - following[2]
                peaks[1] = max(peaks[1], cubic_peak(ends[0], ends[1], ends[2], ends[3], h, start))
                peaks[2] = max(peaks[2], cubic_peak(x[4], x[5], following[4], following[5], h, start))
            x[:] = following
            tau = row[0] if event == NO_EVENT and parts == 1 else tau + h
            now = begin + tau
            known = 0
            if event == IMPACT:
                impacts += 1
                known = 1
                x[4] = 0.0
                x[5] *= p[RESTITUTION]
                moment = p[H_B] * p[MASS] * base(row, tau)[0] - p[K_C] * p[H1] * x[0]
                if x[5] == 0.0 or x[5] * x[5] < 2.0 * (holding - abs(moment)) / p[INERTIA] * rest_angle:
                    x[5] = 0.0
                sg = np.sign(x[5])
                if impacts >= most_impacts:
                    status = FAILED
                    break
            elif event == OVERTURNING:
                status = OVERTURNED_A if sg > 0.0 else OVERTURNED_B
                break
            elif event == UPLIFT:
                known = 2
                sg = np.sign(p[H_B] * p[MASS] * base(row, tau)[0] - p[K_C] * p[H1] * x[0])
                x[4] = x[5] = 0.0
        if status != COMPLETED:
            break
        gained = row[0] - lost
        now = begin + gained
        lost = (now - begin) - gained
        begin = now
    report[STATUS], report[END], report[IMPACTS], report[STEPS], report[SAMPLES] = status, now, impacts, steps, filled
