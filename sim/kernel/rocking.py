"""Hybrid motion: rest, rocking about A, rocking about B, and the events between them.

A step never crosses an event or the end of a segment of the excitation. Events are roots of the step's own Taylor
polynomials, so that they are as accurate as the step. In a phase that starts at theta = 0, that known root is divided
out: the return to zero is found however short the phase, and a chattering block cannot pass through the ground.

While the block rests under a record, whole segments are taken by the exact step of `sim.kernel.resting`; a Taylor
polynomial is computed only where the block may lift or a requested value may be inside the segment. Requests for peaks
and samples do not affect the motion: they are evaluated on unchanged steps.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.resting import ANOTHER_KIND, GLIDED, LOOK_INSIDE, MUST_STEP, SPACE, TABLE_ROWS, glide, propagator
from sim.kernel.steps import (
    COMPLETED,
    END,
    FAILED,
    IMPACT_LIMIT,
    IMPACTS,
    OVERTURNED_A,
    OVERTURNED_B,
    PEAKS,
    REPORT,
    SAMPLES,
    SHORTEST_STEP,
    STATUS,
    STEPS,
    is_physical,
    scales,
    step_length,
    strike,
)
from sim.kernel.taylor import (
    WORK_ROWS,
    forcing_coefficients,
    last_terms,
    resting_coefficients,
    rocking_coefficients,
    state_at,
    tail,
)
from sim.kernel.watching import (
    IMPACT,
    NO_EVENT,
    OVERTURNING,
    UPLIFT,
    first_event,
    is_clear,
    raise_peaks,
)

STARTED, SIDE, KNOWN, BEGIN, LOST, LENGTH = range(6)
"""Indices in the first array of a run's memory: whether it has begun, corner, number of known roots theta = 0, time
at the end of the segments so far [s] and its rounding error, length of the last segment at rest (negative if
tabulated).
"""

MEMORY = (
    "Tuple((float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1],"
    " float64[:,:,::1]))"
)
"""Type of the arrays returned by `memory_of`."""

Array = NDArray[np.float64]
Memory = tuple[Array, Array, Array, Array, Array, Array, Array, Array]

AT_ONCE = 1e-12
"""Difference [s] below which two times count as the same instant."""


@compiled("float64(float64, float64, float64[::1], int64, int64, int64, int64)", internal=True)
def next_sample(
    length: float, begin: float, times: NDArray[np.float64], divisions: int, place: int, filled: int, room: int
) -> float:
    """Time [s] within a segment at which the next sample is due; infinite after the last requested one."""
    if filled >= room or place > divisions > 0:
        return np.inf
    return length * place / divisions if divisions > 0 else times[filled] - begin


def memory_of(order: int, length: float) -> Memory:
    """Memory of a run that has not begun, for Taylor series of the given order; its first segment has the `length` [s].

    Allocated by the caller of `advance`, because numba compiles the allocation of an array anew for each shape.
    """
    kept, table = np.zeros(6), np.zeros((TABLE_ROWS, 6))
    kept[LENGTH] = length
    c, w, a, e = np.zeros((6, order + 1)), np.zeros((WORK_ROWS, order + 1)), np.zeros(order + 1), np.zeros(order + 1)
    return kept, table, c, w, a, e, np.zeros(6), np.zeros(SPACE)


@compiled(
    "void(float64[::1], float64[:,::1], float64[::1], float64[::1], int64, float64[:,::1],"
    f" int64, float64, float64, float64, float64, float64, int64, {MEMORY}, float64[::1])"
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
    memory: Memory,
    report: NDArray[np.float64],
) -> None:
    """Integrate through the next segments. Several calls give results that are bit-identical to those of one call.

    memory, report : of `memory_of`, and zeros of shape (REPORT,), before the first call; managed by this function from
    then on.
    divisions : if positive, every segment is divided into this number of equal parts, a sample is due at the end of
    each part, and `sample_times` is ignored. `samples`, shape (m, 6), receives at most m samples; the report counts
    those of this call. The other arguments are those of `run`.
    """
    n = order
    kept, table, c, w, a, e, following, space = memory
    peaks = report[PEAKS:]
    reach, floor = scales(p)
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
            # the propagator is computed at the second segment of equal length, because its cost would not pay for a
            # single one; a negative length means that it has been computed
            if kept[LENGTH] == row[0]:
                kept[LENGTH] = -row[0]
                propagator(p, row[0], n, tolerance, table, space)
            elif kept[LENGTH] != -row[0]:
                kept[LENGTH] = row[0]
            if kept[LENGTH] == -row[0] and table[0, 0] > 0.0 and row[0] <= longest_step:
                # `glide` writes samples at the ends of segments, and stops before a segment with other samples
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
                forcing_coefficients(row, tau, a, n)
                for k in range(6):
                    c[k, 0] = x[k]
                if sg != 0.0:
                    rocking_coefficients(p, sg, a, c, w, n)
                else:
                    resting_coefficients(p, a, c, n)
            if found == MUST_STEP:
                before, last = last_terms(c, n, reach)
                h = step_length(reach, floor, x[2], x[3], x[5], last, before, n, tolerance, allowed)
                if not h >= min(SHORTEST_STEP, allowed):
                    status = FAILED
                    break
                clear = False
                if sg != 0.0 and n > 4:
                    # most steps contain no event: test one bound for impact and overturning before searching
                    tail(c, n, h, e)
                    clear = is_clear(sg, c[4, 0], c[4, 1], c[4, 2], c[4, 3], c[4, 4], e[0], h, known, theta_limit)
                if not clear:
                    h, event, direction = first_event(p, sg, c, a, n, h, known, theta_limit, e)
                state_at(c, n, h, following)
            if not is_physical(following):
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
                raise_peaks(c, n, max(0.0, peaks_from - now), h, following, sg != 0.0, e, report)
            for k in range(6):
                x[k] = following[k]
            tau = row[0] if event == NO_EVENT and h == remaining else tau + h
            now = begin + tau
            found = MUST_STEP

            if event == NO_EVENT and sg * x[4] < 0.0:
                event = IMPACT  # due to rounding, the end of the step is just past the root
            known = 0
            if event == IMPACT:
                impacts += 1
                known = 1
                acceleration = 0.0
                for k in range(n, -1, -1):
                    acceleration = acceleration * h + a[k]
                strike(p, x, acceleration, rest_angle)
                sg = np.sign(x[5])
                if impacts >= impact_limit:
                    status = IMPACT_LIMIT
                    break
            elif event == OVERTURNING:
                status = OVERTURNED_A if sg > 0.0 else OVERTURNED_B
                break
            elif event == UPLIFT:
                # angle and velocity are zero at the start of the motion: two known roots
                known = 2
                sg = direction
                x[4] = x[5] = 0.0
        if status != COMPLETED:
            break
        # compensated sum, because a record has tens of thousands of equal segments
        gained = row[0] - lost
        now = begin + gained
        lost = (now - begin) - gained
        begin = now
        kept[BEGIN], kept[LOST] = begin, lost
        i += 1
    kept[SIDE], kept[KNOWN] = sg, known
    report[STATUS], report[END], report[IMPACTS], report[STEPS], report[SAMPLES] = status, now, impacts, steps, filled


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
    """Integrate x = [u1, u2, v1, v2, theta, omega], shape (6,), through the excitation. x becomes the end state.

    p : packed parameters, shape (16,).  segments : packed excitation, shape (n, 10).
    sample_times : times [s], ascending, shape (m,); the states at these times are written to `samples`, shape (m, 6).
    order, tolerance : of the Taylor steps; the last two terms stay below the fraction `tolerance` of the velocities.
    longest_step : [s]; with an infinite tolerance, every step has this length or ends at an event or a segment.
    theta_limit : |theta| [rad] that counts as overturning.  rest_angle : [rad], see below.  peaks_from : [s].
    impact_limit : the run ends right after this number of impacts.
    report : shape (8,), written: status, end time, impacts, steps, samples, peaks of |u1|, |u2 - u1|, |theta|.

    At rest, the moment on the block is m = h_b M a_g - k_C h1 u1. The block lifts when |m| > b g M, and rocks about A
    when m > 0 (Eq. 9, A.3). At an impact, omega -> r omega and the corner changes. The block comes to rest when the
    angle of the next bounce, omega^2 / (2 a) with a = (b g M - |m|) / J, stays below `rest_angle`; the error of the
    angle is then at most rest_angle, and that of the energy at most b g M rest_angle.
    """
    report[:REPORT] = 0.0
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
        memory_of(order, segments[0, 0]),
        report,
    )
