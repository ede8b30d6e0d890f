"""Operations of a Taylor step: counted in the source that the kernel compiles, against a count by hand."""

import numpy as np
import pytest

from bench.app.benchmark.arithmetic import arithmetic, series
from bench.comparators.case import SPECIMEN, START, drive
from bench.comparators.kernel.multiply_adds import CHAINS, multiply_adds, multiply_adds_in_lanes
from sim.kernel.lanes import LANES
from sim.kernel.taylor import WORK_ROWS
from tests.sim import recurrences


def test_the_counted_series_is_that_of_the_kernel() -> None:
    order = 12
    _, found = series(order)
    a, c, w = np.zeros(order + 1), np.zeros((6, order + 1)), np.zeros((WORK_ROWS, order + 1))
    c[:, 0] = START.as_array()
    recurrences.forcing(drive().packed()[0], 0.0, a, order)
    recurrences.rocking(SPECIMEN.packed(), 1.0, a, c, w, order)
    assert found == pytest.approx(c, rel=1e-11)


def test_all_but_the_eight_convolutions_grows_with_the_order() -> None:
    """Coefficient k has eight sums of k - 1 fused products of two operations each; the rest is the same for each k."""
    rest = [series(order)[0] - 16 * sum(k - 1 for k in range(1, order)) for order in (8, 14, 20)]
    assert rest[2] - rest[1] == rest[1] - rest[0] > 0


def test_the_loop_of_the_peak_carries_out_its_multiply_adds() -> None:
    single, wide = np.full(2 + CHAINS, 0.5), np.full((2 + CHAINS, LANES), 0.5)
    multiply_adds(single, 3)
    multiply_adds_in_lanes(wide, 3)
    # s <- s / 2 + 1 / 2, from 1 / 2
    assert single[2] == CHAINS * (1.0 - 0.5**4)
    assert (wide[2] == single[2]).all()


def test_the_section_states_share_and_peak_of_a_run_and_of_lanes() -> None:
    # the times are minima: a single run may be interrupted by other processes for longer than it takes
    section = arithmetic(20)
    assert [row["method"] for row in section.rows] == ["single run", "members in lanes"]
    for row in section.rows:
        rate, peak, share = (float(row[key] or 0.0) for key in ("rate", "peak", "share"))
        assert 0.0 < rate < peak
        assert share == pytest.approx(100.0 * rate / peak)
