"""The hybrid motion: rest, rocking about A, rocking about B, and the events between them.

A step never crosses an event or the end of a segment of the excitation. Events are roots of the step's own Taylor
polynomials, so their accuracy is that of the step. In a phase that starts at theta = 0 that known root is divided
out: the return to zero is found however short the phase is, and chatter cannot slip through the ground.

While the block rests under a record, whole segments are taken by the exact step of `sim.kernel.resting`; a Taylor
polynomial is made only where the block may lift or something asked for may lie inside. What is asked for never moves
the motion: peaks and samples are read off, the steps stay the same.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled, inlined
from sim.kernel.packing import GRAVITY, H1, H_B, INERTIA, K_C, MASS, RESTITUTION, B
from sim.kernel.resting import ANOTHER_KIND, GLIDED, LOOK_INSIDE, MUST_STEP, TABLE_ROWS, glide, propagator
from sim.kernel.taylor import WORK_ROWS, forcing_coefficients, resting_coefficients, rocking_coefficients
from sim.kernel.watching import IMPACT, NO_EVENT, OVERTURNING, UPLIFT, first_event, raise_peaks, state_at

COMPLETED, OVERTURNED_A, OVERTURNED_B, IMPACT_LIMIT, FAILED = range(5)
"""How a run ends. IMPACT_LIMIT: right after the impact that was asked for as the last one."""

STATUS, END, IMPACTS, STEPS, SAMPLES, PEAKS = range(6)
"""Places in the report of `run`: status, end time [s], counts, rows of samples filled; from PEAKS on the peaks."""

REPORT = 8
"""Numbers in the report of `run`."""

STARTED, SIDE, KNOWN, BEGIN, LOST, LENGTH = range(6)
"""Places in the first row of `advance`'s memory: begun at all, corner, known roots theta = 0, time at the end of the
segments so far [s] and what rounding took from it, length of the last segment met at rest (negative: tabulated)."""

MEMORY_ROWS = 1 + TABLE_ROWS
"""Rows of `advance`'s memory: its scalars, then the propagator of the resting frame."""

AT_ONCE = 1e-12
"""Times [s] nearer than this are the same instant."""

SHORTEST_STEP = 1e-9
"""Step [s] below which the tolerance cannot be met: the run fails instead of crawling."""

LARGEST_STATE = 1e6
"""No component of a physical state comes near this; beyond it, or not a number, the run fails."""


@compiled("float64(float64, float64, float64[::1], int64, int64, int64, int64)")
def next_sample(
    length: float, begin: float, times: NDArray[np.float64], divisions: int, place: int, filled: int, room: int
) -> float:
    """Time [s] within a segment at which the next sample is due; infinite when none is asked for any more."""
    if filled >= room or place > divisions > 0:
        return np.inf
    return length * place / divisions if divisions > 0 else times[filled] - begin


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], int64, float64[:,::1],"
    " int64, float64, float64, float64, float64, float64, int64, float64[:,::1], float64[::1])"
)
def advance(
    p: NDArray[np.float64],
    segments: NDArray[np.float64],
    x: NDArray[np.float64],
    sample_times: NDArray[np.float64],
    divisions: int,
    samples: NDArray[np.float64],
    order: int,
    tolerance: float,
    longest_step: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: float,
    impact_limit: int,
    memory: NDArray[np.float64],
    report: NDArray[np.float64],
) -> None:
    """Integrate on through the next segments; calling it for parts gives bit for bit what one call gives.

    memory, report : shapes (MEMORY_ROWS, 6) and (REPORT,); zeros before the first call, but for the LENGTH of the first
    segment, then left alone.
    divisions : when positive, samples are due at that many equal parts of every segment, each part's end, and
    `sample_times` is not looked at. `samples`, shape (m, 6), takes at most m of them; the report counts this call's.
    The rest is as in `run`.
    """
    n = order
    c = np.zeros((6, n + 1))
    w = np.zeros((WORK_ROWS, n + 1))
    a = np.zeros(n + 1)
    e = np.zeros(n + 1)
    following = np.zeros(6)
    peaks, table, kept = report[PEAKS:], memory[1:], memory[0]
    holding = p[B] * p[GRAVITY] * p[MASS]
    reach = np.hypot(p[B], p[H_B])
    # velocities below a thousandth of the block's own p alpha need no relative accuracy
    floor = 1e-3 * p[B] / p[H_B] * np.sqrt(p[MASS] * p[GRAVITY] * reach / p[INERTIA])
    if kept[STARTED] == 0.0:
        kept[STARTED] = 1.0
        kept[SIDE] = np.sign(x[4]) if x[4] != 0.0 else np.sign(x[5])
        kept[KNOWN] = 1.0 if x[4] == 0.0 else 0.0
    sg, known, begin, lost = kept[SIDE], int(kept[KNOWN]), kept[BEGIN], kept[LOST]
    status, impacts, steps = int(report[STATUS]), int(report[IMPACTS]), int(report[STEPS])
    room = samples.shape[0]
    filled = 0
    now = begin
    count = segments.shape[0]
    i = 0
    while i < count:
        row = segments[i]
        found = MUST_STEP
        if sg == 0.0 and row[1] == 0.0 and row[2] == 0.0 and row[3] == 0.0 and row[4] == 0.0:
            # a table pays from the second segment of one length on; negative: it is made
            if kept[LENGTH] == row[0]:
                kept[LENGTH] = -row[0]
                propagator(p, row[0], n, tolerance, table)
            elif kept[LENGTH] != -row[0]:
                kept[LENGTH] = row[0]
            if kept[LENGTH] == -row[0] and table[0, 0] > 0.0 and row[0] <= longest_step:
                # samples at the ends of segments are written on the way, others stop it
                until, first = np.inf, room
                if divisions == 1:
                    first = filled
                elif filled < room:
                    until = -np.inf if divisions > 0 else sample_times[filled] - AT_ONCE
                taken = -i
                i, found = glide(
                    p, table, segments, i, x, until, peaks_from, peaks, kept[BEGIN:], following, samples, first
                )
                taken += i
                steps += taken
                filled = min(filled + taken, room) if divisions == 1 else filled
                begin, lost = kept[BEGIN], kept[LOST]
                now = begin
                if i == count:
                    break
                if found == ANOTHER_KIND:
                    continue
                row = segments[i]
        tau = 0.0
        place = 1
        due = next_sample(row[0], begin, sample_times, divisions, place, filled, room)
        if found == GLIDED and due < row[0] - AT_ONCE:
            found = LOOK_INSIDE
        while row[0] - tau > 1e-14 * row[0]:
            steps += 1
            remaining = row[0] - tau
            allowed = min(remaining, longest_step)
            h, event, direction = allowed, NO_EVENT, 0.0
            if found != GLIDED:
                forcing_coefficients(row, tau, a, w, n)
                for k in range(6):
                    c[k, 0] = x[k]
                if sg != 0.0:
                    rocking_coefficients(p, sg, a, c, w, n)
                else:
                    resting_coefficients(p, a, c, n)
            if found == MUST_STEP:
                # length of the step from the last two coefficients (Jorba and Zou, 2005)
                scale = max(max(abs(x[2]), abs(x[3])) / reach, abs(x[5]), floor)
                finite = True
                for k in range(n - 1, n + 1):
                    size = (abs(c[2, k]) + abs(c[3, k])) / reach + abs(c[5, k])
                    finite = finite and size < np.inf
                    if size * h**k > tolerance * scale:
                        h = (tolerance * scale / size) ** (1.0 / k)
                if not finite or (h < SHORTEST_STEP and h < allowed):
                    status = FAILED
                    break
                h, event, direction = first_event(p, sg, c, a, n, h, known, theta_limit, e)
                state_at(c, n, h, following)
            largest = 0.0
            for k in range(6):
                largest = max(largest, abs(following[k]))
            if not largest < LARGEST_STATE:
                status = FAILED
                break

            while due <= tau + h + AT_ONCE:
                if due >= tau + h - AT_ONCE:
                    for k in range(6):
                        samples[filled, k] = following[k]
                else:
                    state_at(c, n, due - tau, samples[filled])
                filled += 1
                place += 1
                due = next_sample(row[0], begin, sample_times, divisions, place, filled, room)
            if found != GLIDED and now + h > peaks_from:
                raise_peaks(c, n, max(0.0, peaks_from - now), h, sg != 0.0, e, peaks)
            for k in range(6):
                x[k] = following[k]
            tau = row[0] if event == NO_EVENT and h == remaining else tau + h
            now = begin + tau
            found = MUST_STEP

            if event == NO_EVENT and sg * x[4] < 0.0:
                event = IMPACT  # rounding put the end of the step just past the root
            known = 0
            if event == IMPACT:
                impacts += 1
                known = 1
                x[4] = 0.0
                x[5] *= p[RESTITUTION]
                acceleration = 0.0
                for k in range(n, -1, -1):
                    acceleration = acceleration * h + a[k]
                moment = p[H_B] * p[MASS] * acceleration - p[K_C] * p[H1] * x[0]
                if x[5] == 0.0 or x[5] * x[5] < 2.0 * (holding - abs(moment)) / p[INERTIA] * rest_angle:
                    x[5] = 0.0
                sg = np.sign(x[5])
                if impacts >= impact_limit:
                    status = IMPACT_LIMIT
                    break
            elif event == OVERTURNING:
                status = OVERTURNED_A if sg > 0.0 else OVERTURNED_B
                break
            elif event == UPLIFT:
                # theta grows from zero angle and zero velocity: two known roots
                known = 2
                sg = direction
                x[4] = x[5] = 0.0
        if status != COMPLETED:
            break
        # compensated sum: a record has tens of thousands of equal segments
        gained = row[0] - lost
        now = begin + gained
        lost = (now - begin) - gained
        begin = now
        kept[BEGIN], kept[LOST] = begin, lost
        i += 1
    kept[SIDE], kept[KNOWN] = sg, known
    report[STATUS], report[END], report[IMPACTS], report[STEPS], report[SAMPLES] = status, now, impacts, steps, filled


@inlined
def run(
    p: NDArray[np.float64],
    segments: NDArray[np.float64],
    x: NDArray[np.float64],
    sample_times: NDArray[np.float64],
    samples: NDArray[np.float64],
    order: int,
    tolerance: float,
    longest_step: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: float,
    impact_limit: int,
    report: NDArray[np.float64],
) -> None:
    """Integrate x = [u1, u2, v1, v2, theta, omega], shape (6,), through the excitation; x becomes the end state.

    p : packed parameters, shape (16,).  segments : packed excitation, shape (n, 10).
    sample_times : ascending [s], shape (m,); the states there go to `samples`, shape (m, 6).
    order, tolerance : of the Taylor steps; the last two coefficients stay below `tolerance` of the velocities.
    longest_step : [s]; with an infinite tolerance every step has this length or ends at an event or a segment.
    theta_limit : |theta| [rad] that is overturning.  rest_angle : [rad], see below.  peaks_from : [s].
    impact_limit : the run ends right after this many impacts.
    report : shape (8,), written: status, end time, impacts, steps, samples, peaks of |u1|, |u2 - u1|, |theta|.

    At rest the block feels m = h_b M a_g - k_C h1 u1 and lifts when |m| > b g M, to A when m > 0 (Eq. 9, A.3). At an
    impact omega -> r omega and the corner changes. The block comes to rest when the next bounce, omega^2 / (2 a) with
    a = (b g M - |m|) / J, stays below `rest_angle`: the angle then errs by at most rest_angle and the energy by
    b g M rest_angle.
    """
    memory = np.zeros((MEMORY_ROWS, 6))
    memory[0, LENGTH] = segments[0, 0]
    for k in range(REPORT):
        report[k] = 0.0
    advance(
        p,
        segments,
        x,
        sample_times,
        0,
        samples,
        order,
        tolerance,
        longest_step,
        theta_limit,
        rest_angle,
        peaks_from,
        impact_limit,
        memory,
        report,
    )
