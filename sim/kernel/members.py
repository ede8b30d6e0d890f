"""Many motions at once, LANES of them in parallel, each bit-identical to the single motion of `sim.kernel.rocking`.

Every member has its own time, step, contact mode and position in its excitation; the arithmetic of a step is done for
all lanes at once. Events, and rest under a record, are computed for each member separately. When a member has ended,
its lane takes the next member.
"""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled, inlined
from sim.kernel.lanes import LANES, get, put
from sim.kernel.packing import COUPLED
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
    scales,
    step_length,
    strike,
)
from sim.kernel.taylor import (
    forcing_coefficients,
    last_terms,
    limits,
    resting_coefficients,
    rocking_coefficients,
    state_at,
    tail,
)
from sim.kernel.watching import IMPACT, NO_EVENT, OVERTURNING, UPLIFT, first_event, is_clear, raise_peaks
from sim.kernel.workspace import (
    ASKS,
    BEFORE,
    BEGIN,
    FLOOR,
    KNOWN,
    LAST,
    LENGTH,
    LOST,
    MEMBER,
    MET,
    REACH,
    SEGMENT,
    SIDE,
    STEPPED,
    TAIL,
    TAU,
    WAITING,
    WORK,
    Array,
    Places,
    Workspace,
    workspace,
)

MEMBERS = (
    "float64[:,::1], int64[::1], float64[:,::1], int64[:,::1], float64[:,::1], int64, float64, float64, float64,"
    " float64[::1], int64, float64[:,::1]"
)
"""Types of the arguments of `advance_members`."""


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
    lanes = workspace(order)
    arguments = specimens, specimen_of, segments, spans, states, order, tolerance, theta_limit, rest_angle, peaks_from
    if advance_lanes(*arguments, impact_limit, reports, lanes):
        # compiled only when a block first rests under an acceleration that is not a sine
        from sim.kernel.members_at_rest import advance_with_rest, scratch

        advance_with_rest(*arguments, impact_limit, reports, lanes, *scratch())


@inlined
def end_segment(values: Array, places: Places, lane: int, length: float) -> None:
    """Set a lane to the start of its next segment."""
    # compensated sum, because a record has tens of thousands of equal segments
    begin, gained = values[BEGIN, lane], length - values[LOST, lane]
    values[BEGIN, lane] = begin + gained
    values[LOST, lane] = (values[BEGIN, lane] - begin) - gained
    values[TAU, lane] = 0.0
    places[SEGMENT, lane] += 1


@inlined
def is_linear(segment: Array) -> bool:
    """Whether the acceleration of a segment is linear in time."""
    return segment[1] == 0.0 and segment[2] == 0.0 and segment[3] == 0.0 and segment[4] == 0.0


@compiled(f"boolean({MEMBERS}, {WORK})")
def advance_lanes(
    specimens: Array,
    specimen_of: NDArray[np.int64],
    segments: Array,
    spans: NDArray[np.int64],
    states: Array,
    n: int,
    tolerance: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: Array,
    impact_limit: int,
    reports: Array,
    lanes: Workspace,
) -> bool:
    """Take steps of all lanes. Returns False when every member has ended, and True when the block of a member rests at
    the start of a segment of linear acceleration.

    The exact step for such a segment, in the lanes marked in the row ASKS, is taken by `sim.kernel.members_at_rest`,
    which then calls this function again with the same `lanes`, the arrays of `workspace`.
    """
    count = states.shape[0]
    values, places, p, row, a, c, w, following, bounds, a1, c1, after, e = lanes
    while True:
        active, rocking, watching, asking = 0, False, False, False
        for lane in range(LANES):
            while True:
                j = places[MEMBER, lane]
                if j < 0:
                    if places[WAITING, 0] == count:
                        break
                    j = places[MEMBER, lane] = places[WAITING, 0]
                    places[WAITING, 0] += 1
                    i, theta = spans[j, 0], states[j, 4]
                    for k in range(16):
                        p[k, lane] = specimens[specimen_of[j], k]
                    for k in range(REPORT):
                        reports[j, k] = 0.0
                    places[SEGMENT, lane], places[STEPPED, lane] = i, -1
                    values[TAU, lane] = values[BEGIN, lane] = values[LOST, lane] = 0.0
                    values[MET, lane] = segments[i, 0]
                    values[REACH, lane], values[FLOOR, lane] = scales(specimens[specimen_of[j]])
                    values[SIDE, lane] = np.sign(theta if theta != 0.0 else states[j, 5])
                    places[KNOWN, lane] = 1 if theta == 0.0 else 0
                i = places[SEGMENT, lane]
                if i == spans[j, 1]:
                    reports[j, END] = values[BEGIN, lane]
                    places[MEMBER, lane] = -1
                    continue
                if not segments[i, 0] - values[TAU, lane] > 1e-14 * segments[i, 0]:
                    end_segment(values, places, lane, segments[i, 0])
                    continue
                rests = values[SIDE, lane] == 0.0 and values[TAU, lane] == 0.0 and places[STEPPED, lane] != i
                if rests and is_linear(segments[i]):
                    places[ASKS, lane] = 1
                    asking = True
                    break
                active += 1
                rocking = rocking or values[SIDE, lane] != 0.0
                watching = watching or peaks_from[j] < np.inf
                for k in range(6):
                    c[k, 0, lane] = states[j, k]
                for k in range(10):
                    row[k, lane] = segments[i, k]
                break
        if asking or active == 0:
            return asking

        forcing_coefficients(row, get(values, TAU), a, n)
        if rocking:
            rocking_coefficients(p, get(values, SIDE), a, c, w, n)
        for lane in range(LANES):
            j = places[MEMBER, lane]
            if j >= 0 and values[SIDE, lane] == 0.0:
                for k in range(6):
                    c1[k, 0] = c[k, 0, lane]
                for k in range(n + 1):
                    a1[k] = a[k, lane]
                resting_coefficients(specimens[specimen_of[j]], a1, c1, n)
                for i in range(6):
                    for k in range(n + 1):
                        c[i, k, lane] = c1[i, k]
        before, last = last_terms(c, n, get(values, REACH))
        put(values, BEFORE, before)
        put(values, LAST, last)
        for lane in range(LANES):
            values[LENGTH, lane] = 0.0
            if places[MEMBER, lane] >= 0:
                values[LENGTH, lane] = step_length(
                    values[REACH, lane],
                    values[FLOOR, lane],
                    c[2, 0, lane],
                    c[3, 0, lane],
                    c[5, 0, lane],
                    values[LAST, lane],
                    values[BEFORE, lane],
                    n,
                    tolerance,
                    row[0, lane] - values[TAU, lane],
                )
        state_at(c, n, get(values, LENGTH), following)
        tail(c, n, get(values, LENGTH), values)  # written to the first row, TAIL
        if watching:
            limits(c, n, get(values, LENGTH), following, bounds)

        for lane in range(LANES):
            j = places[MEMBER, lane]
            if j < 0:
                continue
            sg, h, remaining = values[SIDE, lane], values[LENGTH, lane], row[0, lane] - values[TAU, lane]
            reports[j, STEPS] += 1.0
            status, event, direction, now = COMPLETED, NO_EVENT, 0.0, values[BEGIN, lane] + values[TAU, lane]
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
                        values[TAIL, lane],
                        h,
                        places[KNOWN, lane],
                        theta_limit,
                    )
                )
                if clear and not seen:
                    seen = (
                        bounds[0, lane] <= reports[j, PEAKS]
                        and bounds[1, lane] <= reports[j, PEAKS + 1]
                        and bounds[2, lane] <= reports[j, PEAKS + 2]
                    )
                if not (clear and seen):
                    for i in range(6):
                        for k in range(n + 1):
                            c1[i, k] = c[i, k, lane]
                    for k in range(n + 1):
                        a1[k] = a[k, lane]
                if not clear:
                    h, event, direction = first_event(
                        specimens[specimen_of[j]], sg, c1, a1, n, h, places[KNOWN, lane], theta_limit, e
                    )
                    if event != NO_EVENT:
                        state_at(c1, n, h, after)
                if not is_physical(after):
                    status = FAILED
            if status == COMPLETED:
                if not seen and now + h > peaks_from[j]:
                    raise_peaks(c1, n, start, h, after, sg != 0.0, e, reports[j])
                state = states[j]
                for k in range(6):
                    state[k] = after[k]
                values[TAU, lane] = row[0, lane] if event == NO_EVENT and h == remaining else values[TAU, lane] + h
                now = values[BEGIN, lane] + values[TAU, lane]
                if event == NO_EVENT and sg * state[4] < 0.0:
                    event = IMPACT  # due to rounding, the end of the step is just past the root
                places[KNOWN, lane] = 0
                if event == IMPACT:
                    reports[j, IMPACTS] += 1.0
                    places[KNOWN, lane] = 1
                    acceleration = 0.0
                    for k in range(n, -1, -1):
                        acceleration = acceleration * h + a[k, lane]
                    strike(specimens[specimen_of[j]], state, acceleration, rest_angle)
                    values[SIDE, lane] = np.sign(state[5])
                    if reports[j, IMPACTS] >= impact_limit:
                        status = IMPACT_LIMIT
                elif event == OVERTURNING:
                    status = OVERTURNED_A if sg > 0.0 else OVERTURNED_B
                elif event == UPLIFT:
                    # angle and velocity are zero at the start of the motion: two known roots
                    places[KNOWN, lane] = 2
                    values[SIDE, lane] = direction
                    state[4] = state[5] = 0.0
            if status != COMPLETED:
                reports[j, STATUS], reports[j, END] = status, now
                places[MEMBER, lane] = -1
