"""Condition numbers of motions from rest, against another solver; digits of an end time."""

from math import isnan

import numpy as np
import pytest

from bench.comparators.catalogue import solve
from bench.prediction.conditioning import Condition, condition
from sim.excitation import SineProgram, Sweep
from sim.rocking import Motion, simulate
from sim.specimen import Specimen

AMPLITUDE = 1.01 * 9.81 / 8.0
CHANGE = 1e-7
"""Relative change for the other solver, whose errors are about 1e-13."""


def motion(coupled: Specimen, dwell: Sweep, times: np.ndarray, tolerance: float = 1e-10) -> Motion:
    return simulate(coupled, SineProgram([dwell]), sample_times=times, tolerance=tolerance)


def test_the_condition_number_is_that_of_another_solver() -> None:
    coupled, times = Specimen().coupled(0.97), np.arange(0.0, 8.0, 0.01)

    def samples(amplitude: float) -> np.ndarray:
        drive = SineProgram([Sweep.dwell(8.0, amplitude, 17.5)])
        found = solve("dop853", coupled, drive, sample_times=times, peaks_from=None, tolerance=1e-13).samples
        assert found is not None
        return found

    dwell = Sweep.dwell(8.0, AMPLITUDE, 17.5)
    found = condition(coupled, dwell, times, motion(coupled, dwell, times))
    first, changed = samples(AMPLITUDE), samples(AMPLITUDE * (1.0 + CHANGE))
    expected = (np.abs(changed - first) / np.abs(first).max(axis=0)).max() / CHANGE
    assert found.number == pytest.approx(expected, rel=0.01)
    assert found.end_time_error == 0.0


def test_the_error_of_an_overturning_time_is_stated_and_its_false_digits_are_left_out() -> None:
    coupled, times = Specimen().coupled(0.40), np.arange(0.0, 5.0, 0.01)
    dwell = Sweep.dwell(5.0, AMPLITUDE, 16.0)
    made = motion(coupled, dwell, times)
    found = condition(coupled, dwell, times, made)
    other = solve("dop853", coupled, SineProgram([dwell]), peaks_from=None, tolerance=1e-13)
    # a relative error of 1e-12 in an input moves the end by a microsecond
    assert found.number > 1e6
    assert found.end_time_error == pytest.approx(abs(made.end_time - other.end_time), rel=0.5)
    assert found.rounded_end(made.end_time) == pytest.approx(other.end_time, abs=2.0 * found.end_time_error)
    assert len(str(found.rounded_end(made.end_time))) <= 8


@pytest.mark.parametrize(("error", "shown"), [(1.7e-6, 3.68156), (0.0, 3.681557425), (2.0, 3.681557425)])
def test_the_end_keeps_its_true_digits(error: float, shown: float) -> None:
    assert Condition(1.0, 0.0, error).rounded_end(3.681557425) == shown


def test_a_motion_that_ends_otherwise_at_the_finest_tolerance_has_no_condition() -> None:
    coupled, times = Specimen().coupled(0.40), np.arange(0.0, 3.0, 0.01)
    short = Sweep.dwell(3.0, AMPLITUDE, 16.0)
    overturned = motion(coupled, Sweep.dwell(5.0, AMPLITUDE, 16.0), times)
    found = condition(coupled, short, times, overturned)
    assert isnan(found.number)
    assert found.rounded_end(3.25) == 3.25
