"""Condition numbers of motions from rest, against another solver; digits of an end time."""

from math import floor, inf, isnan, log10, nan

import numpy as np
import pytest

from bench.comparators.catalogue import solve
from bench.prediction.conditioning import condition, end_time_errors, rounded_time
from bench.prediction.history import histories, runs_table
from bench.prediction.requests import HistoryRequest
from sim.excitation import SampledRecord, SineProgram, Sweep
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
    assert rounded_time(made.end_time, found.end_time_error) == pytest.approx(
        other.end_time, abs=2.0 * found.end_time_error
    )
    assert len(str(rounded_time(made.end_time, found.end_time_error))) <= 8


@pytest.mark.parametrize(
    ("error", "shown"),
    [(1.7e-6, 3.68156), (0.0, 3.681557425), (0.3, 4.0), (2.0, nan), (inf, nan), (nan, nan)],
)
def test_a_time_keeps_its_true_digits(error: float, shown: float) -> None:
    assert rounded_time(3.681557425, error) == pytest.approx(shown, abs=0.0, nan_ok=True)


def test_a_motion_that_ends_otherwise_at_the_finest_tolerance_has_no_condition_and_no_end_time() -> None:
    coupled, times = Specimen().coupled(0.40), np.arange(0.0, 3.0, 0.01)
    short = Sweep.dwell(3.0, AMPLITUDE, 16.0)
    overturned = motion(coupled, Sweep.dwell(5.0, AMPLITUDE, 16.0), times)
    found = condition(coupled, short, times, overturned)
    assert isnan(found.number)
    assert isnan(rounded_time(overturned.end_time, found.end_time_error))


def test_the_end_time_of_a_coarse_solver_keeps_only_its_true_digits() -> None:
    """RK4 in steps of a millisecond; DOP853 tells how far off its time of overturning is."""
    request = HistoryRequest(omega=(16.0,), beta=(0.25,), amplitude_factor=2.0, duration=10.0, solver="paper")
    (history,) = histories(Specimen(), request)
    runs = runs_table([history])
    shown, error = (float(runs[name].values[0]) for name in ("end_time_s", "end_time_error_s"))
    drive = SineProgram([Sweep.dwell(10.0, 2.0 * 9.81 / 8.0, 16.0)])
    exact = solve("dop853", Specimen().coupled(0.25), drive, peaks_from=None, tolerance=1e-13)
    assert exact.overturned is not None
    assert error == pytest.approx(abs(history.end_time - exact.end_time), rel=0.01)
    assert shown != history.end_time
    assert shown == pytest.approx(exact.end_time, abs=2.0 * error + 10.0 ** floor(log10(error)))


def test_a_time_of_overturning_under_a_record_keeps_only_its_true_digits() -> None:
    """Pulses that hardly overturn the block, integrated coarsely."""
    dt, times = 0.02, np.arange(0.0, 8.0, 0.02)
    record = SampledRecord(3.0 * np.sin(5.0 * times) * np.sin(0.7 * times), dt)
    specimens = [Specimen().coupled(beta) for beta in (0.25, 0.97)]
    coarse = [simulate(each, record, tolerance=1e-4) for each in specimens]
    exact = [solve("dop853", each, record, peaks_from=None, tolerance=1e-12) for each in specimens]
    assert all(each.overturned for each in exact)
    for error, rough, fine in zip(end_time_errors(specimens, record, coarse), coarse, exact, strict=True):
        assert error == pytest.approx(abs(rough.end_time - fine.end_time), rel=0.01)
