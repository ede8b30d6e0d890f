"""Roots and peaks of polynomials against a dense scan and against roots that were planted."""

from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import polynomial as series
from numpy.typing import NDArray

from sim.excitation import SineProgram, Sweep
from sim.kernel import roots
from sim.specimen import Specimen
from tests.sim import recurrences
from tests.sim.recurrences import evaluate, first_root, greatest_magnitude

COEFFICIENTS = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=12)
GRID = np.linspace(0.0, 1.0, 4001)


def planted(*values: float) -> NDArray[np.float64]:
    """A polynomial with these roots, positive at 0."""
    p = np.asarray(series.polyfromroots(values), dtype=np.float64)
    return p if p[0] > 0.0 else -p


def test_evaluate_is_value_slope_and_half_bend() -> None:
    assert evaluate(np.array([1.0, 2.0, 3.0, 4.0]), 3, 0.5) == pytest.approx((3.25, 8.0, 9.0))


@pytest.mark.parametrize("gap", [1e-1, 1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("root", [1e-3, 0.2, 0.713, 0.8999])
def test_a_dip_below_zero_is_seen_however_narrow(root: float, gap: float) -> None:
    p = planted(root, root + gap, 1.7)
    # what rounding of the coefficients alone does to the root
    conditioning = float(series.polyval(root, np.abs(p))) / (gap * (1.7 - root))
    assert first_root(p, 3, 1.0) == pytest.approx(root, abs=1e-15 * conditioning)


@pytest.mark.parametrize("clearance", [1e-3, 1e-6, 1e-9])
def test_a_dip_that_stays_positive_is_no_root(clearance: float) -> None:
    p = planted(0.4, 0.4)
    p[0] += clearance
    assert first_root(p, 2, 1.0) == -1.0


def test_root_at_or_before_the_start_is_the_start() -> None:
    assert first_root(np.array([0.0, 1.0]), 1, 1.0) == 0.0
    assert first_root(np.array([-1.0, 1.0]), 1, 1.0) == 0.0


def test_root_beyond_the_end_is_none() -> None:
    assert first_root(planted(1.0001), 1, 1.0) == -1.0


@settings(max_examples=100, deadline=None)
@given(COEFFICIENTS)
def test_no_earlier_root_is_missed(coefficients: list[float]) -> None:
    p = np.array(coefficients)
    p[0] = abs(p[0]) + 0.01
    values = np.asarray(series.polyval(GRID, p))
    root, below = first_root(p, p.size - 1, 1.0), np.flatnonzero(values <= 0.0)
    if below.size:
        assert 0.0 < root <= GRID[below[0]] + 1e-15
    if root >= 0.0:
        assert abs(float(series.polyval(root, p))) < 1e-12


@settings(max_examples=100, deadline=None)
@given(COEFFICIENTS, st.floats(0.0, 0.9))
def test_no_peak_is_missed_or_invented(coefficients: list[float], start: float) -> None:
    p = np.array(coefficients)
    times = np.append(GRID[start <= GRID], start)
    sampled = np.abs(series.polyval(times, p)).max()
    curvature = sum(k * k * abs(c) for k, c in enumerate(coefficients))
    found = greatest_magnitude(p, p.size - 1, start, 1.0)
    assert sampled * (1.0 - 1e-13) <= found <= sampled + curvature * 2.5e-4**2 + 1e-15


def test_the_work_stays_bounded_where_the_bounds_say_nothing() -> None:
    # sixteen roots in [-1, 2]: coefficients of a thousand for values of a billionth
    p = planted(*np.linspace(-0.97, 1.93, 16))
    assert 0.0 <= first_root(p, 16, 1.0) <= 1.0
    assert greatest_magnitude(p, 16, 0.0, 1.0) >= abs(p[0])


def first_step(scale: float, duration: float, omega: tuple[float, float]) -> tuple[np.ndarray, float]:
    """The polynomial of u1, shape (17,), and the length [s] of the first step of a sweep that begins at rest with
    `scale` times the acceleration of uplift: the tolerance, which is absolute there, allows a very long one.
    """
    n, specimen = 16, Specimen(beta=0.4)
    amplitude = specimen.uplift_acceleration * scale
    row = SineProgram([Sweep(duration, (amplitude, amplitude), omega)]).packed()[0]
    a, c = np.zeros(n + 1), np.zeros((6, n + 1))
    recurrences.forcing(row, 0.0, a, n)
    recurrences.resting(specimen.packed(), a, c, n)
    sizes = {k: abs(c[2, k]) + abs(c[3, k]) for k in (n - 1, n)}
    return c[0].copy(), min(duration, *((1e-14 / size) ** (1.0 / k) for k, size in sizes.items()))


@pytest.mark.parametrize(
    ("scale", "duration", "omega"),
    [
        (1e-12, 0.16, (108.0, 230.0)),
        (1e-16, 0.7, (194.6, 35.9)),
        (1e-20, 2.7, (48.0, 220.0)),
        (1e-100, 27.0, (130.5, 130.8)),
        (1e-305, 0.2, (46.6, 137.0)),
        (2e-311, 8.1, (220.2, 163.7)),
    ],
)
def test_peaks_of_tiny_motions_cost_no_more_than_those_of_others(
    monkeypatch: pytest.MonkeyPatch, scale: float, duration: float, omega: tuple[float, float]
) -> None:
    p, h = first_step(scale, duration, omega)
    count = 0

    def counted(*arguments: Any) -> tuple[float, float, float]:
        nonlocal count
        count += 1
        assert count < 1000
        return evaluate(*arguments)

    ends = *evaluate(p, 16, 0.0)[:2], *evaluate(p, 16, h)[:2]
    monkeypatch.setattr(roots, "evaluate", counted)
    found = cast(Any, roots.greatest_magnitude).py_func(p, 16, 0.0, h, *ends, 0.0)
    sampled = np.abs(series.polyval(np.linspace(0.0, h, 20_001), p)).max()
    assert found == pytest.approx(sampled, rel=1e-6, abs=1e-300)
