"""Many motions at once under excitations with segments of linear acceleration, such as records.

While a block rests at the start of such a segment, whole segments are taken by the exact step of `sim.kernel.resting`;
all other steps are those of `sim.kernel.members`. This module is separate, because sines do not need it.
"""

import numpy as np

from sim.kernel.compiled import compiled
from sim.kernel.lanes import LANES
from sim.kernel.members import MEMBERS, advance_lanes, end_segment, is_linear
from sim.kernel.resting import LOOK_INSIDE, MUST_STEP, SPACE, TABLE_ROWS, glide, propagator
from sim.kernel.steps import PEAKS, STEPS
from sim.kernel.taylor import forcing_coefficients, resting_coefficients
from sim.kernel.watching import raise_peaks
from sim.kernel.workspace import (
    ASKS,
    BEGIN,
    KNOWN,
    LOST,
    MEMBER,
    MET,
    SEGMENT,
    STEPPED,
    WORK,
    Array,
    Places,
    Workspace,
)


def scratch() -> tuple[Array, Array, Array]:
    """Arrays that `advance_with_rest` needs besides those of the lanes: propagators of the lanes, shape (LANES,
    TABLE_ROWS, 6), scratch space, shape SPACE, and no samples, shape (0, 6).
    """
    return np.zeros((LANES, TABLE_ROWS, 6)), np.zeros(SPACE), np.empty((0, 6))


@compiled(f"void({MEMBERS}, {WORK}, float64[:,:,::1], float64[:,:,::1], float64[:,::1])")
def advance_with_rest(
    specimens: Array,
    specimen_of: Places,
    segments: Array,
    spans: Places,
    states: Array,
    n: int,
    tolerance: float,
    theta_limit: float,
    rest_angle: float,
    peaks_from: Array,
    impact_limit: int,
    reports: Array,
    lanes: Workspace,
    tables: Array,
    space: Array,
    no_samples: Array,
) -> None:
    """Take the exact steps requested by `advance_lanes`, then call it again, until every member has ended. The last
    three arguments are the arrays of `scratch`.
    """
    values, places, _, _, _, _, _, _, _, a1, c1, after, e = lanes
    asking = True
    while asking:
        for lane in range(LANES):
            while places[ASKS, lane] != 0:
                j, i = places[MEMBER, lane], places[SEGMENT, lane]
                watched_from = float(peaks_from[j])
                specimen, table = specimens[specimen_of[j]], tables[lane]
                length, found = segments[i, 0], MUST_STEP
                places[ASKS, lane] = 0
                # the propagator is computed at the second segment of equal length, because its cost would not pay for
                # a single one; a negative length means that it has been computed
                if values[MET, lane] == length:
                    values[MET, lane] = -length
                    propagator(specimen, length, n, tolerance, table, space)
                elif values[MET, lane] != -length:
                    values[MET, lane] = length
                if values[MET, lane] == -length and table[0, 0] > 0.0:
                    e[0], e[1] = values[BEGIN, lane], values[LOST, lane]
                    own, peaks = segments[: spans[j, 1]], reports[j, PEAKS:]
                    i, found = glide(
                        specimen, table, own, i, states[j], np.inf, watched_from, peaks, e, after, no_samples, 0
                    )
                    values[BEGIN, lane], values[LOST, lane] = e[0], e[1]
                    reports[j, STEPS] += i - places[SEGMENT, lane]
                    places[SEGMENT, lane] = i
                    if i < spans[j, 1] and found == LOOK_INSIDE:
                        # the exact step is known, so that the polynomial is needed only for the peaks within it
                        length = segments[i, 0]
                        forcing_coefficients(segments[i], 0.0, a1, n)
                        for k in range(6):
                            c1[k, 0] = states[j, k]
                        resting_coefficients(specimen, a1, c1, n)
                        after[4] = after[5] = 0.0
                        if values[BEGIN, lane] + length > watched_from:
                            start = max(0.0, watched_from - values[BEGIN, lane])
                            raise_peaks(c1, n, start, length, after, False, e, reports[j])
                        for k in range(4):
                            states[j, k] = after[k]
                        reports[j, STEPS] += 1.0
                        places[KNOWN, lane] = 0
                        end_segment(values, places, lane, length)
                        places[ASKS, lane] = i + 1 < spans[j, 1] and is_linear(segments[i + 1])
                if found == MUST_STEP:
                    places[STEPPED, lane] = i
        asking = advance_lanes(
            specimens,
            specimen_of,
            segments,
            spans,
            states,
            n,
            tolerance,
            theta_limit,
            rest_angle,
            peaks_from,
            impact_limit,
            reports,
            lanes,
        )
