"""Packed excitations and their Taylor coefficients against the formulas they stand for."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import SampledRecord, SineProgram, Sweep
from tests.sim import recurrences


def acceleration(row: NDArray[np.float64], t: float) -> float:
    """a_g of a packed row, as the module's docstring defines it."""
    amplitude = row[1] + row[2] * t + row[3] * t**2 + row[4] * t**3
    return float(amplitude * np.sin(row[5] + row[6] * t + 0.5 * row[7] * t**2) + row[8] + row[9] * t)


def taylor(row: NDArray[np.float64], t: float, ahead: float) -> float:
    """a_g at t + ahead by the series of the kernel about t."""
    a = np.zeros(31)
    recurrences.forcing(row, t, a, 30)
    return float(np.polynomial.polynomial.polyval(ahead, a))


NUMBER = st.floats(-3.0, 3.0)


@settings(max_examples=50, deadline=None)
@given(st.lists(NUMBER, min_size=9, max_size=9), st.floats(0.0, 2.0), st.floats(0.0, 0.1))
def test_series_is_the_acceleration(numbers: list[float], t: float, ahead: float) -> None:
    row = np.array([10.0, *numbers])
    row[6] *= 8.0
    size = 1.0 + float(np.abs(row[1:5]).sum()) * 10.0
    assert taylor(row, t, ahead) == pytest.approx(acceleration(row, t + ahead), abs=1e-13 * size)


def test_series_without_sine_is_the_straight_line() -> None:
    row = SampledRecord(np.array([1.0, 3.0]), 0.5).packed()[0]
    assert taylor(row, 0.25, 0.25) == 3.0


def test_a_dwell_is_a_sine() -> None:
    row = SineProgram([Sweep.dwell(3.0, 1.2, 17.0)], phase=0.3).packed()[0]
    assert acceleration(row, 1.7) == pytest.approx(1.2 * np.sin(0.3 + 17.0 * 1.7), rel=1e-13)


def test_the_phase_is_continuous_over_sweeps() -> None:
    rows = SineProgram([Sweep(2.0, (0.0, 1.0), (22.0, 22.0)), Sweep(3.0, (1.0, 1.0), (22.0, 17.0))]).packed()
    assert acceleration(rows[0], 2.0) == pytest.approx(acceleration(rows[1], 0.0), abs=1e-12)
    later = rows[1]
    assert later[6] + later[7] * later[0] == pytest.approx(17.0)


def test_amplitude_is_a_smoothstep_and_the_row_agrees() -> None:
    sweep = Sweep(4.0, (0.2, 1.0), (10.0, 12.0))
    row = np.array(sweep.row(pi / 2))
    t = np.array([0.0, 1.0, 2.0, 4.0])
    assert sweep.amplitude_at(t) == pytest.approx([0.2, 0.325, 0.6, 1.0])
    assert np.polyval(row[4:0:-1], t) == pytest.approx(sweep.amplitude_at(t))


def test_record_rows_join_at_the_samples() -> None:
    values = np.array([0.0, 1.0, -2.0, 0.5])
    record = SampledRecord(values, 0.01)
    rows = record.packed()
    assert record.duration == pytest.approx(0.03)
    assert [acceleration(row, 0.01) for row in rows] == pytest.approx(values[1:])
    assert rows[:, 8] == pytest.approx(values[:-1])


@pytest.mark.parametrize("values", [np.zeros(1), np.zeros((2, 2)), np.array([0.0, np.inf])])
def test_record_refuses_bad_samples(values: NDArray[np.float64]) -> None:
    with pytest.raises(InvalidInput, match="record"):
        SampledRecord(values, 0.01)


def test_bad_times_and_frequencies_are_refused() -> None:
    with pytest.raises(InvalidInput, match="dt"):
        SampledRecord(np.zeros(3), 0.0)
    with pytest.raises(InvalidInput, match="duration"):
        SineProgram([Sweep.dwell(0.0, 1.0, 10.0)])
    with pytest.raises(InvalidInput, match="omega"):
        SineProgram([Sweep.dwell(1.0, 1.0, 0.0)])
