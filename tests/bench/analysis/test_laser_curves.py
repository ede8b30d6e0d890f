"""Error curves of the lasers from the motion of the second storey, on motions that another solver made."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import tau

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from bench.analysis.curve_posterior import LaserCurves
from bench.analysis.draws import Draws
from bench.analysis.laser_curves import laser_curves
from bench.analysis.linearity import Effect, LinearFrame
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import LINEARITY, SCALES, SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2, SIGNALS, U1
from bench.analysis.storey_equations import storey_motion
from sim.specimen import Specimen
from tests.bench.calibrated import calibration

RATE, LIMIT, WHOLE, MISMATCH, BLOCK = 500.0, 1.6e-4, 0.2, 1e-3, 4.0
SPECIMEN = Specimen()
K, C = SPECIMEN.frame.k2 / SPECIMEN.frame.m2, SPECIMEN.frame.dashpots[1] / SPECIMEN.frame.m2
TIME = np.arange(round(24.0 * RATE)) / RATE
GROUND, TABLE = (LinearFrame(SPECIMEN, grounded=grounded) for grounded in (True, False))

AT_REST = PeakReadings(
    drift=0.02,
    sign=1.0,
    lasers=(0.01, 0.03),
    speeds=(0.0, 0.0),
    zero=np.zeros((2, 1)),
    swings=(0.01, 0.01),
    at_rest=True,
)
"""A peak relative to the zero at rest."""

Array = np.ndarray


@dataclass(frozen=True)
class Motion:
    """Displacements [m] of the table and, absolute, of both storeys; acceleration of the table [m/s2]."""

    table: Array
    first: Array
    second: Array
    acceleration: Array

    @property
    def drift(self) -> Array:
        return self.second - self.first


def motions(
    strokes: Mapping[int, float], softer: float = 1.0, cubic: float = 0.0, friction: float = 0.0
) -> list[Motion]:
    """The second storey above a first one that something moves for 16 s by up to `strokes` [m], one for each seed: any
    table, and any force on it.

    The upper columns have `softer` times the nominal stiffness, which increases by `cubic` times the square of the
    drift, and a friction that is this share of the elastic force at a drift of 50 mm.
    """
    rise = np.clip(np.minimum(TIME - 2.0, 18.0 - TIME), 0.0, 1.0)
    band = signal.butter(4, (0.8, 5.0), "bandpass", fs=RATE, output="sos")
    firsts, tables = [], []
    for seed, stroke in strokes.items():
        random = np.random.default_rng(seed)
        first, table = (signal.sosfiltfilt(band, random.standard_normal(TIME.size)) for _ in range(2))
        firsts.append(stroke * first * rise / np.abs(first * rise).max())
        tables.append(0.6 * stroke * table * rise / np.abs(table * rise).max())
    below, n = CubicSpline(TIME, np.transpose(firsts)), len(firsts)
    moving, k, yielding = below.derivative(), softer * K, friction * K * 0.05

    def rate(t: float, y: Array) -> Array:
        drift, speed = y[:n] - below(t), y[n:] - moving(t)
        force = k * (1.0 + cubic * drift**2) * drift + C * speed + yielding * np.tanh(speed / 5e-3)
        return np.concatenate((y[n:], -force))

    found = solve_ivp(rate, (0.0, TIME[-1]), np.zeros(2 * n), t_eval=TIME, rtol=1e-9, atol=1e-10, max_step=0.05)
    return [
        Motion(table, first, second, CubicSpline(TIME, table)(TIME, 2))
        for table, first, second in zip(tables, firsts, found.y[:n], strict=True)
    ]


def curve(waves: float, phase: float, slope: float = 0.0) -> Callable[[Array], Array]:
    """Error of a laser [m] as a function of the true displacement, zero at rest."""
    return lambda x: LIMIT * (np.sin(tau * waves * x / WHOLE + phase) - np.sin(phase)) + slope * x


def signals(
    moved: Motion,
    errors: tuple[Callable[[Array], Array], Callable[[Array], Array]],
    noise: float = 0.0,
    seed: int = 0,
    grounded: bool = True,
) -> Array:
    found = np.zeros((TIME.size, len(SIGNALS)))
    found[:, DISPLACEMENT], found[:, ACCELERATION] = moved.table, moved.acceleration
    random = np.random.default_rng([seed, 7])
    base = 0.0 if grounded else moved.table
    for column, storey, error in zip((LASER_1, LASER_2), (moved.first, moved.second), errors, strict=True):
        found[:, column] = storey - base + error(storey - base) + noise * random.standard_normal(TIME.size)
    found[:, DRIFT] = found[:, LASER_2] - found[:, LASER_1]
    found[:, U1] = found[:, LASER_1] - (moved.table if grounded else 0.0)
    return found


def found_in(*tests: Array, frame: LinearFrame = GROUND) -> LaserCurves | None:
    return laser_curves(tests, frame, RATE, (LIMIT, LIMIT), (WHOLE, WHOLE), MISMATCH, BLOCK)


def peaks(found: LaserCurves, tests: list[tuple[Motion, Array]]) -> tuple[float, float, float]:
    """Relative errors of the ratio of the largest drifts of two tests: with raw and with corrected readings, and the
    stated standard uncertainty of the latter.
    """
    raw, corrected, effects = [], [], list[tuple[Effect, Effect]]()
    for moved, seen in tests:
        place = int(np.abs(moved.drift).argmax())
        first, second = seen[place, LASER_1], seen[place, LASER_2]
        true, share = moved.drift[place], 1.0 / moved.drift[place]
        raw.append((second - first) * share - 1.0)
        expected = [found.expected(k, np.array([each]))[0] for k, each in enumerate((first, second))]
        corrected.append((second - expected[1] - first + expected[0] - true) * share)
        places = [np.array([each, 0.0]) for each in (first, second)]
        weights = np.array([share, -share])
        effects.append((Effect(places[0], -weights), Effect(places[1], weights)))
    moments = found.errors(effects).moments
    stated = float(np.sqrt(moments[0, 0] + moments[1, 1] - 2.0 * moments[0, 1]))
    return raw[1] - raw[0], corrected[1] - corrected[0], stated


def above_sines(parts: Sequence[tuple[float, float]], time: Array) -> tuple[Array, Array]:
    """Displacements [m] of a first storey that is a sum of sines, given by omega [rad/s] and size [m], and of the
    second one in the steady state.
    """
    moving = [(1.0 + 1j * omega * C / K, omega**2 / K, size * np.exp(1j * omega * time)) for omega, size in parts]
    first = sum(np.imag(each) for _, _, each in moving)
    second = sum(np.imag(one / (one - bending) * each) for one, bending, each in moving)
    return np.asarray(first), np.asarray(second)


@cache
def two_motions() -> list[Motion]:
    return motions({1: 0.03, 2: 0.02})


@pytest.mark.parametrize(("frame", "grounded"), [(GROUND, True), (TABLE, False)])
def test_exact_readings_leave_nothing_in_the_equations(frame: LinearFrame, grounded: bool) -> None:
    """Also with another stiffness than the nominal one, which is fitted."""
    none = curve(0.0, 0.0)
    for moved in (two_motions()[0], *motions({3: 0.03}, softer=0.93)):
        seen = storey_motion(signals(moved, (none, none), grounded=grounded), frame, RATE)
        assert seen is not None
        found = seen.equations((np.atleast_2d, np.atleast_2d))
        assert found.rows.shape == (seen.kept.size, 3)
        assert 10 < found.removed < seen.kept.size // 10
        assert np.sqrt(np.mean(found.values**2)) < 1e-6


@pytest.mark.parametrize("draws", [4, pytest.param(16, marks=pytest.mark.soak)])
@pytest.mark.parametrize(("waves", "other", "grounded"), [(0.7, 1.2, True), (3.5, 0.8, False), (4.6, 5.3, True)])
def test_the_errors_of_a_ratio_become_small_and_are_as_large_as_stated(
    waves: float, other: float, grounded: bool, draws: int
) -> None:
    raw, left, stated = [], [], []
    for number in range(draws):
        phases = np.random.default_rng([number, 3]).uniform(0.0, tau, 2)
        slope = MISMATCH * np.random.default_rng([number, 4]).standard_normal()
        errors = curve(waves, phases[0]), curve(other, phases[1], slope)
        seen = [signals(each, errors, 1.5e-5, 2 * number + k, grounded) for k, each in enumerate(two_motions())]
        found = found_in(*seen, frame=GROUND if grounded else TABLE)
        assert found is not None
        exact = [signals(each, errors, grounded=grounded) for each in two_motions()]
        one = peaks(found, list(zip(two_motions(), exact, strict=True)))
        for values, value in zip((raw, left, stated), one, strict=True):
            values.append(value)
    off = np.array(left) / np.array(stated)
    assert np.sqrt(np.mean(np.square(left))) < 0.05 * np.sqrt(np.mean(np.square(raw)))
    assert 0.3 < np.sqrt(np.mean(off**2)) < 1.4
    assert np.abs(off).max() < 3.5


@pytest.mark.parametrize("draws", [3, pytest.param(12, marks=pytest.mark.soak)])
@pytest.mark.parametrize(("cubic", "friction"), [(100.0, 0.0), (0.0, 0.01), (40.0, 0.01)])
def test_stiffness_that_is_not_constant_and_friction_cause_no_false_errors(
    cubic: float, friction: float, draws: int
) -> None:
    """16 to 69 % more stiffness at the largest drifts, of 40 to 83 mm, and a friction of 1 % of the force at 50 mm."""
    off, sizes = [], []
    moved = motions(
        {seed: 0.02 if seed % 2 else 0.015 for seed in range(1, 2 * draws + 1)}, cubic=cubic, friction=friction
    )
    for number in range(draws):
        tests = moved[2 * number :][:2]
        phases = np.random.default_rng([number, 5]).uniform(0.0, tau, 2)
        errors = curve(1.5, phases[0]), curve(1.2, phases[1])
        found = found_in(*(signals(each, errors, 1.5e-5, k) for k, each in enumerate(tests)))
        assert found is not None
        _, left, stated = peaks(found, [(each, signals(each, errors)) for each in tests])
        off.append(left / stated)
        sizes.append(stated)
    # the linearity errors are up to 0.5 % of these drifts; friction is larger noise, which widens the interval
    assert max(sizes) < (2e-3 if friction else 2e-4)
    assert np.sqrt(np.mean(np.square(off))) < 1.5


def test_many_weak_motions_tell_the_errors_without_a_common_proportion() -> None:
    """Drifts of up to 7 mm for 2 min: readings that are all error, which solve every equation, are no explanation."""
    moved = motions(dict.fromkeys(range(1, 9), 0.003))
    off = []
    for phase in (1.0, 3.0, 4.0):
        errors = curve(1.5, phase, 0.01), curve(1.2, phase + 1.0, 0.01)
        found = found_in(*(signals(each, errors, 1.5e-5, k) for k, each in enumerate(moved)))
        assert found is not None
        raw, left, stated = peaks(found, [(each, signals(each, errors)) for each in moved[::3][:2]])
        assert stated < 3e-4 < abs(raw)
        off.append(left / stated)
        alike = np.concatenate(found.places)
        assert abs(alike @ found.mean[:-1]) < 4e-3 * (alike @ alike)
    assert np.abs(off).max() < 2.0


def test_a_delay_that_wanders_between_the_lasers_causes_no_false_errors() -> None:
    """A held reading of a laser at 4 kHz becomes older and younger by its period of 0.25 ms within 7 s."""
    moved, none = two_motions()[0], curve(0.0, 0.0)
    seen = signals(moved, (none, none), 1.5e-5)
    late = 2.5e-4 * ((TIME / 7.0) % 1.0 - 0.5)
    seen[:, LASER_2] -= late * np.gradient(moved.second, 1.0 / RATE)
    seen[:, DRIFT] = seen[:, LASER_2] - seen[:, LASER_1]
    found = found_in(seen)
    assert found is not None
    places = np.linspace(0.8 * moved.second.min(), 0.8 * moved.second.max(), 20)
    bent = found.expected(1, places)
    bent -= np.polyval(np.polyfit(places, bent, 1), places)
    # the delay shifts readings by up to 0.1 mm
    assert np.abs(bent).max() < 1e-5


def test_more_tests_of_the_same_lasers_tell_more() -> None:
    errors = curve(1.5, 1.0), curve(2.2, 2.0)
    one, two = (signals(each, errors, 1.5e-5, k) for k, each in enumerate(two_motions()))
    alone, both = found_in(two), found_in(one, two)
    assert alone is not None
    assert both is not None
    effect = [(None, Effect(np.array([-0.02, 0.0, 0.02]), np.array([1.0, -2.0, 1.0])))]
    assert both.errors(effect).moments[0, 0] < alone.errors(effect).moments[0, 0]


def test_missing_samples_are_bridged_and_a_motion_without_enough_of_them_tells_nothing() -> None:
    errors = curve(1.5, 1.0), curve(1.2, 2.0)
    seen = signals(two_motions()[0], errors, 1.5e-5)
    whole = found_in(seen)
    assert whole is not None
    few = seen.copy()
    few[::150, [LASER_1, DRIFT]] = np.nan
    found = found_in(few)
    assert found is not None
    places = np.linspace(0.9 * whole.places[1][0], 0.9 * whole.places[1][-1], 9)
    np.testing.assert_allclose(found.expected(1, places), whole.expected(1, places), atol=5e-6)
    many = seen.copy()
    many[::20, [LASER_1, DRIFT]] = np.nan
    assert found_in(many) is None
    assert found_in(np.zeros_like(seen)) is None
    assert found_in(seen[:3500]) is None
    # a further test that tells nothing changes nothing, and what is beyond the readings of the first stays uncertain
    beside = found_in(seen, 2.0 * many)
    assert beside is not None
    assert len(beside.mean) > len(whole.mean)
    np.testing.assert_allclose(beside.expected(1, places), whole.expected(1, places), atol=1e-5)
    near, far = (
        np.sqrt(beside.errors([(None, Effect(np.array([0.0, x]), np.array([-1.0, 1.0])))]).moments[0, 0])
        for x in (places[-1], beside.places[1][-1])
    )
    assert far > 1.5 * near


def test_a_laser_that_errs_more_than_its_data_sheet_allows_is_named() -> None:
    plain = SensorUncertainty(SensorAccuracy(), (WHOLE, WHOLE))
    for times, named in ((1.0, 0), (3.0, 1)):

        def larger(x: Array, times: float = times) -> Array:
            return times * curve(1.5, 1.0)(x)

        seen = [signals(each, (curve(1.2, 2.0), larger), 1.5e-5, k) for k, each in enumerate(two_motions())]
        found = plain.found_in(seen, GROUND, RATE, BLOCK)
        remarks = found.rough(found.shapes([]))
        assert len(remarks) == named
        assert all("laser_2 is 0." in each and "its data sheet allows 0.16 mm" in each for each in remarks)


def test_near_a_long_gap_there_are_no_equations() -> None:
    errors = curve(1.5, 1.0), curve(1.2, 2.0)
    seen = [signals(each, errors, 1.5e-5, k) for k, each in enumerate(two_motions())]
    lost = seen[0].copy()
    begin = round(6.0 * RATE)
    lost[begin : begin + round(0.25 * RATE), [LASER_1, DRIFT]] = np.nan
    whole, found = found_in(*seen), found_in(lost, seen[1])
    assert whole is not None
    assert found is not None
    assert found.noise < 1.2 * whole.noise
    exact = [(each, signals(each, errors)) for each in two_motions()]
    _, left, stated = peaks(found, exact)
    assert abs(left) < 3.0 * stated < 5e-4
    # an accelerometer that is lost, for lasers on the table
    table = signals(two_motions()[0], errors, grounded=False)
    table[:, ACCELERATION] = np.nan
    assert found_in(table, frame=TABLE) is None


def test_nothing_is_corrected_at_rest_and_a_missing_reading_stays_missing() -> None:
    found = found_in(signals(two_motions()[0], (curve(1.5, 1.0), curve(1.2, 2.0)), 1.5e-5))
    assert found is not None
    for laser in (0, 1):
        expected = found.expected(laser, np.array([0.0, np.nan, 0.01]))
        assert expected[0] == 0.0
        np.testing.assert_array_equal(np.isnan(expected), [False, True, False])


@pytest.mark.parametrize("modulated", [0.0, 0.2])
def test_a_long_and_weak_motion_is_not_taken_for_an_error(modulated: float) -> None:
    """48 s with a drift of 7 mm: readings that are all error would solve every equation exactly."""
    time = np.arange(round(48.0 * RATE)) / RATE
    parts = (12.5, 4.5e-3), (13.2, -2.25e-3 * modulated), (11.8, 2.25e-3 * modulated)
    first, second = above_sines(parts, time)
    random = np.random.default_rng(1)
    seen = np.zeros((time.size, len(SIGNALS)))
    seen[:, ACCELERATION] = np.gradient(np.gradient(0.5 * first, time), time)
    for column, storey in ((LASER_1, first), (LASER_2, second)):
        seen[:, column] = 5e-5 * np.round((storey + 5e-6 * random.standard_normal(time.size)) / 5e-5)
    seen[:, DRIFT] = seen[:, LASER_2] - seen[:, LASER_1]
    found = found_in(seen)
    assert found is None or np.abs(found.expected(0, np.array([-4e-3, 4e-3]))).max() < LIMIT


def test_the_sensors_have_the_errors_of_the_tests_unless_these_tell_none() -> None:
    seen = signals(two_motions()[0], (curve(1.5, 1.0), curve(1.2, 2.0)), 1.5e-5)
    plain = SensorUncertainty(SensorAccuracy(), (WHOLE, WHOLE))
    found = plain.found_in([seen], GROUND, RATE, BLOCK)
    assert found.shapes_known
    assert found.corrected
    assert found.curves is not None
    assert plain.found_in([seen], GROUND, RATE, 0.0) is plain
    assert plain.found_in([np.zeros_like(seen)], GROUND, RATE, BLOCK) is plain
    calibrated = replace(plain, calibration=calibration(-0.1, 0.1))
    left = calibrated.found_in([seen], GROUND, RATE, BLOCK).curves
    assert left is not None
    assert 0.0 < left.covariance[-1, -1] <= 1.01 * calibrated.mismatch**2 < 0.02 * plain.mismatch**2
    draws = Draws(np.random.default_rng(1), 400)
    errors = found.drift_errors([AT_REST, AT_REST], draws)
    # the difference between the scales is one of the errors that were found
    assert SCALES not in errors
    expected = found.curves.errors([(AT_REST.effect(0).reversed, AT_REST.effect(1))]).moments[0, 0] ** 0.5
    assert np.std(errors[LINEARITY][0]) == pytest.approx(expected, rel=0.15)
    np.testing.assert_allclose(errors[LINEARITY][0], errors[LINEARITY][1], atol=1e-12)
    assert found.u1_linearity([AT_REST], [0.0], draws).shape == (1, 400)


def test_errors_that_were_found_contain_that_of_the_reference_sensor_in_the_lasers() -> None:
    seen = signals(two_motions()[0], (curve(1.5, 1.0), curve(1.2, 2.0)), 1.5e-5)
    coarse = calibration(-0.1, 0.1, common_linearity=1e-4)
    found = SensorUncertainty(SensorAccuracy(), (WHOLE, WHOLE), coarse).found_in([seen], GROUND, RATE, BLOCK)
    own, still, moved = (
        np.std(errors(Draws(np.random.default_rng(1), 4000)))
        for errors in (
            lambda draws: found.linearity(0, [AT_REST], draws),
            lambda draws: found.u1_linearity([AT_REST], [0.0], draws),
            lambda draws: found.u1_linearity([AT_REST], [0.02], draws),
        )
    )
    assert still == pytest.approx(own, rel=1e-9)
    assert moved > own + 1e-5
