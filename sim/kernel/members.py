"""Many motions at once, LANES of them in parallel, each bit-identical to the single motion of `sim.kernel.rocking`.

Every member has its own time, step, contact mode and position in its excitation; the arithmetic of a step is done for
all lanes at once. Events, and rest under a record, are computed for each member separately. When a member has ended,
its lane takes the next one.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled
from sim.kernel.lanes import LANES, get
from sim.kernel.packing import COUPLED, H_B, B
from sim.kernel.resting import LOOK_INSIDE, TABLE_ROWS, glide, propagator
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
    SHORTEST_STEP,
    STATUS,
    STEPS,
    is_physical,
    step_length,
    strike,
)
from sim.kernel.taylor import WORK_ROWS, forcing_coefficients, resting_coefficients, rocking_coefficients
from sim.kernel.watching import (
    IMPACT,
    NO_EVENT,
    OVERTURNING,
    UPLIFT,
    bends,
    first_event,
    is_clear,
    raise_peaks,
    state_at,
    tail,
)


@compiled(
    "void(float64[:,::1], int64[::1], float64[:,::1], int64[:,::1], float64[:,::1], int64, float64, float64, float64,"
    " float64[::1], int64, float64[:,::1])"
)
def advance_members(
    specimens: NDArray[np.float64],
    specimen_of: NDArray[np.int64],
    segments: NDArray[np.float64],
    spans: NDArray[np.int64],
    states: NDArray[np.float64],
    order: int,
    tolerance: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: NDArray[np.float64],
    impact_limit: int,
    reports: NDArray[np.float64],
) -> None:
    """Integrate m members through their excitations. `states`, shape (m, 6), become their end states.

    specimens : packed parameters, shape (k, 16); member j uses row `specimen_of[j]`.
    segments : packed excitations, shape (n, 10); member j uses the rows from spans[j, 0] up to spans[j, 1], exclusive.
    peaks_from : shape (m,) [s].  reports : shape (m, REPORT), written.
    The other arguments are those of `sim.kernel.rocking.run`.
    """
    n, count = order, states.shape[0]
    # arrays of all lanes
    p, row, x = np.ones((16, LANES)), np.zeros((10, LANES)), np.zeros((6, LANES))
    a, c, w = np.zeros((n + 1, LANES)), np.zeros((6, n + 1, LANES)), np.zeros((WORK_ROWS, n + 1, LANES))
    following, bounds = np.zeros((6, LANES)), np.zeros((3, LANES))
    side, clock, length, rests = np.ones((1, LANES)), np.zeros((1, LANES)), np.zeros((1, LANES)), np.zeros((1, LANES))
    # per lane: its member, its segment, number of known roots, time since the segment's start, start of the segment and
    # its rounding error, length of the last segment at rest (negative if tabulated), table
    member, segment, known = np.full(LANES, -1), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    tau, begin, met, table = np.zeros(LANES), np.zeros((LANES, 2)), np.zeros(LANES), np.zeros((LANES, TABLE_ROWS, 6))
    # arrays of one lane, for events and rest
    a1, c1, after, e = np.zeros(n + 1), np.zeros((6, n + 1)), np.zeros(6), np.zeros(n + 1)
    no_samples = np.empty((0, 6))
    waiting = 0
    while True:
        active, rocking, watching = 0, 0, 0
        for lane in range(LANES):
            while True:
                j = member[lane]
                if j < 0:
                    if waiting == count:
                        break
                    j = member[lane] = waiting
                    waiting += 1
                    for k in range(16):
                        p[k, lane] = specimens[specimen_of[j], k]
                    for k in range(REPORT):
                        reports[j, k] = 0.0
                    state = states[j]
                    segment[lane] = spans[j, 0]
                    tau[lane] = begin[lane, 0] = begin[lane, 1] = 0.0
                    met[lane] = segments[spans[j, 0], 0]
                    side[0, lane] = np.sign(state[4]) if state[4] != 0.0 else np.sign(state[5])
                    known[lane] = 1 if state[4] == 0.0 else 0
                i = segment[lane]
                if i == spans[j, 1]:
                    reports[j, END] = begin[lane, 0]
                    member[lane] = -1
                    continue
                this = segments[i]
                if not this[0] - tau[lane] > 1e-14 * this[0]:
                    # compensated sum, because a record has tens of thousands of equal segments
                    gained = this[0] - begin[lane, 1]
                    end = begin[lane, 0] + gained
                    begin[lane, 1] = (end - begin[lane, 0]) - gained
                    begin[lane, 0] = end
                    tau[lane] = 0.0
                    segment[lane] += 1
                    continue
                sine = this[1] != 0.0 or this[2] != 0.0 or this[3] != 0.0 or this[4] != 0.0
                if side[0, lane] == 0.0 and tau[lane] == 0.0 and not sine:
                    # a table is worth its cost from the second segment of equal length on; a negative length means that
                    # the table has been computed
                    if met[lane] == this[0]:
                        met[lane] = -this[0]
                        propagator(specimens[specimen_of[j]], this[0], n, tolerance, table[lane])
                    elif met[lane] != -this[0]:
                        met[lane] = this[0]
                    if met[lane] == -this[0] and table[lane, 0, 0] > 0.0:
                        last, peaks = segments[: spans[j, 1]], reports[j, PEAKS:]
                        i, found = glide(
                            specimens[specimen_of[j]],
                            table[lane],
                            last,
                            i,
                            states[j],
                            np.inf,
                            peaks_from[j],
                            peaks,
                            begin[lane],
                            after,
                            no_samples,
                            0,
                        )
                        reports[j, STEPS] += i - segment[lane]
                        segment[lane] = i
                        if i == spans[j, 1]:
                            continue
                        this = segments[i]
                        if found == LOOK_INSIDE:
                            # the exact step is known, so that the polynomial is needed only for the peaks within it
                            forcing_coefficients(this, 0.0, a1, n)
                            for k in range(6):
                                c1[k, 0] = states[j, k]
                            resting_coefficients(specimens[specimen_of[j]], a1, c1, n)
                            after[4] = after[5] = 0.0
                            if begin[lane, 0] + this[0] > peaks_from[j]:
                                start = max(0.0, peaks_from[j] - begin[lane, 0])
                                raise_peaks(c1, n, start, this[0], after, False, e, peaks)
                            for k in range(4):
                                states[j, k] = after[k]
                            reports[j, STEPS] += 1.0
                            tau[lane], known[lane] = this[0], 0
                            continue
                        if found != 0:
                            continue
                break
            j = member[lane]
            if j < 0:
                continue
            active += 1
            rocking += 1 if side[0, lane] != 0.0 else 0
            watching += 1 if peaks_from[j] < np.inf else 0
            for k in range(6):
                x[k, lane] = states[j, k]
                c[k, 0, lane] = states[j, k]
            for k in range(10):
                row[k, lane] = segments[segment[lane], k]
            clock[0, lane] = tau[lane]
        if active == 0:
            break

        forcing_coefficients(row, get(clock, 0), a, n)
        if rocking > 0:
            rocking_coefficients(p, get(side, 0), a, c, w, n)
        if rocking < active:
            for lane in range(LANES):
                if member[lane] >= 0 and side[0, lane] == 0.0:
                    for k in range(6):
                        c1[k, 0] = x[k, lane]
                    for k in range(n + 1):
                        a1[k] = a[k, lane]
                    resting_coefficients(specimens[specimen_of[member[lane]]], a1, c1, n)
                    for i in range(6):
                        for k in range(n + 1):
                            c[i, k, lane] = c1[i, k]
        for lane in range(LANES):
            length[0, lane] = 0.0
            j = member[lane]
            if j >= 0:
                reach = np.hypot(p[B, lane], p[H_B, lane])
                before = (abs(c[2, n - 1, lane]) + abs(c[3, n - 1, lane])) / reach + abs(c[5, n - 1, lane])
                final = (abs(c[2, n, lane]) + abs(c[3, n, lane])) / reach + abs(c[5, n, lane])
                length[0, lane] = step_length(
                    specimens[specimen_of[j]],
                    x[2, lane],
                    x[3, lane],
                    x[5, lane],
                    final,
                    before,
                    n,
                    tolerance,
                    row[0, lane] - tau[lane],
                )
        state_at(c, n, get(length, 0), following)
        tail(c, n, get(length, 0), rests)
        if watching > 0:
            bends(c, n, get(length, 0), bounds)

        for lane in range(LANES):
            j = member[lane]
            if j < 0:
                continue
            sg, h, remaining = side[0, lane], length[0, lane], row[0, lane] - tau[lane]
            reports[j, STEPS] += 1.0
            status, event, direction, now = COMPLETED, NO_EVENT, 0.0, begin[lane, 0] + tau[lane]
            start = max(0.0, peaks_from[j] - now)
            seen = start >= h
            if not h >= min(SHORTEST_STEP, remaining):
                status = FAILED
            else:
                for k in range(6):
                    after[k] = following[k, lane]
                clear = sg == 0.0 and p[COUPLED, lane] == 0.0
                clear = clear or (
                    sg != 0.0
                    and is_clear(
                        sg,
                        c[4, 0, lane],
                        c[4, 1, lane],
                        c[4, 2, lane],
                        c[4, 3, lane],
                        c[4, 4, lane],
                        rests[0, lane],
                        h,
                        known[lane],
                        theta_limit,
                    )
                )
                if clear and not seen:
                    most_1, most_2 = (
                        max(abs(x[0, lane]), abs(after[0])),
                        max(abs(x[1, lane] - x[0, lane]), abs(after[1] - after[0])),
                    )
                    most_3, part = max(abs(x[4, lane]), abs(after[4])), 0.125 * h * h
                    seen = (
                        most_1 + part * bounds[0, lane] <= reports[j, PEAKS]
                        and most_2 + part * bounds[1, lane] <= reports[j, PEAKS + 1]
                        and most_3 + part * bounds[2, lane] <= reports[j, PEAKS + 2]
                    )
                if not (clear and seen):
                    for i in range(6):
                        for k in range(n + 1):
                            c1[i, k] = c[i, k, lane]
                    for k in range(n + 1):
                        a1[k] = a[k, lane]
                if not clear:
                    h, event, direction = first_event(
                        specimens[specimen_of[j]], sg, c1, a1, n, h, known[lane], theta_limit, e
                    )
                    if event != NO_EVENT:
                        state_at(c1, n, h, after)
                if not is_physical(after):
                    status = FAILED
            if status == COMPLETED:
                if not seen and now + h > peaks_from[j]:
                    raise_peaks(c1, n, start, h, after, sg != 0.0, e, reports[j, PEAKS:])
                state = states[j]
                for k in range(6):
                    state[k] = after[k]
                tau[lane] = row[0, lane] if event == NO_EVENT and h == remaining else tau[lane] + h
                now = begin[lane, 0] + tau[lane]
                if event == NO_EVENT and sg * state[4] < 0.0:
                    event = IMPACT  # due to rounding, the end of the step is just past the root
                known[lane] = 0
                if event == IMPACT:
                    reports[j, IMPACTS] += 1.0
                    known[lane] = 1
                    acceleration = 0.0
                    for k in range(n, -1, -1):
                        acceleration = acceleration * h + a[k, lane]
                    strike(specimens[specimen_of[j]], state, acceleration, rest_angle)
                    side[0, lane] = np.sign(state[5])
                    if reports[j, IMPACTS] >= impact_limit:
                        status = IMPACT_LIMIT
                elif event == OVERTURNING:
                    status = OVERTURNED_A if sg > 0.0 else OVERTURNED_B
                elif event == UPLIFT:
                    # angle and velocity are zero at the start of the motion: two known roots
                    known[lane] = 2
                    side[0, lane] = direction
                    state[4] = state[5] = 0.0
            if status != COMPLETED:
                reports[j, STATUS], reports[j, END] = status, now
                member[lane] = -1
