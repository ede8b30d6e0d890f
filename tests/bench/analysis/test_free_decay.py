"""Frames from decays: against motions that scipy made, with lasers that scale, lag and bend; and how sure it is."""

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import solve_ivp

from bench.analysis.free_decay.covariance import Errors, fit_uncertainty
from bench.analysis.free_decay.decay import Decay, Setting, combine, pulsed_decay, released_decay
from bench.analysis.free_decay.fit import fit_from_scratch
from bench.analysis.free_decay.response import K1, K2, OMEGA1, XI1, XI2, Constants, quantities, response, slopes
from bench.analysis.free_decay.stretch import Unusable, stretch_of
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from sim.specimen import Frame
from tests.bench.calibrated import calibration

Array = NDArray[np.float64]

RATE = 1000.0
QUIET, BEGIN, LENGTH = 2.0, 2.6, 16.0
FRAME = Frame(k1=224.0, k2=54.0, m1=1.05, m2=1.08, xi1=0.013, xi2=0.027)
TIME = np.arange(round(LENGTH * RATE)) / RATE


def constants(frame: Frame = FRAME, k_c: float = 0.0) -> Constants:
    return Constants(frame.m1, frame.m2, frame.k1 + k_c, frame.k2, *frame.dashpots)


def sensors(accuracy: SensorAccuracy) -> SensorUncertainty:
    return SensorUncertainty(accuracy, (0.2, 0.2))


def setting(**changes: object) -> Setting:
    known = Setting(RATE, sensors(SensorAccuracy()), False, (FRAME.m1, FRAME.m2), np.zeros((2, 2)))
    return replace(known, **changes)  # type: ignore[arg-type]


def system(c: Constants) -> tuple[Array, Array]:
    """Relative displacements and velocities under the acceleration of the table, (A, B)."""
    k = np.array([[c.k1 + c.k2, -c.k2], [-c.k2, c.k2]]) / np.array([[c.m1], [c.m2]])
    d = np.array([[c.c1 + c.c2, -c.c2], [-c.c2, c.c2]]) / np.array([[c.m1], [c.m2]])
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -d]])
    return a, np.array([[0.0], [0.0], [-1.0], [-1.0]])


def table() -> tuple[Array, Array]:
    """Displacement and acceleration of a table that makes a pulse and is then pushed about by the frame."""
    inside = (TIME >= QUIET) & (TIME <= BEGIN)
    phi = 2.0 * pi * (TIME - QUIET) / (BEGIN - QUIET)
    w = 2.0 * pi / (BEGIN - QUIET)
    x = np.where(inside, 0.008 * (1.0 - np.cos(phi)) ** 2, 0.0)
    a = np.where(inside, 0.016 * w**2 * (np.cos(phi) - np.cos(2.0 * phi)), 0.0)
    since = np.maximum(TIME - BEGIN, 0.0)
    # a smooth begin: x and x' are continuous
    swing, fade = 5.7, 0.4
    x = x + 2e-4 * np.exp(-fade * since) * (1.0 - np.cos(swing * since))
    rate = complex(-fade, swing)
    a = a + 2e-4 * np.where(since > 0.0, fade**2 * np.exp(-fade * since) - (rate**2 * np.exp(rate * since)).real, 0.0)
    return x, a


@cache
def moved_by_table(c: Constants) -> Array:
    """Relative displacements of the storeys, shape (n, 2), by scipy's own first-order hold with matrix exponentials."""
    _, moved, _ = signal.lsim((*system(c), np.eye(4), np.zeros((4, 1))), table()[1], TIME)
    moved.setflags(write=False)
    return moved[:, :2]


def recording(c: Constants, *, lag: float = 6e-4, bend: float = 2.0, on_table: bool = False) -> Array:
    """Signals of a perfect bench with imperfect lasers, shape (n, 6)."""
    x, a = table()
    seen = moved_by_table(c) + (0.0 if on_table else x[:, None])
    late = np.column_stack([np.interp(TIME - lag, TIME, one) for one in seen.T])
    gains, offsets = np.array([1.002, 0.997]), np.array([1e-4, -2e-4])
    signals = np.zeros((TIME.size, 6))
    signals[:, 0], signals[:, 1] = a, x
    signals[:, 4:6] = gains * late + offsets + bend * late**3
    signals[:, 3] = signals[:, 5] - signals[:, 4]
    return signals


@pytest.mark.parametrize(
    ("k_c", "on_table", "lag"), [(0.0, False, 6e-4), (53.0, False, 0.0), (0.0, True, 6e-4), (200.0, False, 2e-3)]
)
def test_the_frame_of_an_exact_motion_is_found_whatever_the_lasers_do(k_c: float, on_table: bool, lag: float) -> None:
    truth = constants(k_c=k_c)
    decay = pulsed_decay(recording(truth, lag=lag, on_table=on_table), setting(on_table=on_table), QUIET, BEGIN)
    error = np.abs(decay.quantities / quantities(truth) - 1.0)
    assert np.all(error < [1e-5, 1e-5, 1e-4, 1e-4, 5e-4, 5e-4, 3e-6, 5e-6]), error
    # a tenth of the noise of a laser
    assert np.sqrt(np.mean(decay.fit.residual**2)) < 1e-6
    assert decay.fit.values[8:10] == pytest.approx([1.002, 0.997], abs=2e-4)
    assert decay.fit.values[10:12] == pytest.approx([lag, lag], abs=3e-5)


def test_quantities_are_those_of_the_specimen_they_were_made_from() -> None:
    assert quantities(constants())[[XI1, XI2]] == pytest.approx([FRAME.xi1, FRAME.xi2], rel=1e-12)
    assert quantities(constants())[OMEGA1:] == pytest.approx(FRAME.natural_frequencies, rel=1e-12)


def test_the_response_in_modes_is_that_of_matrix_exponentials() -> None:
    c, random = constants(), np.random.default_rng(3)
    x = np.cumsum(random.standard_normal(400)) * 1e-3
    found = response(c, 0.01)
    a, _ = system(c)
    feed = c.c1 / c.m1
    entry = np.array([feed, 0.0, c.k1 / c.m1 + a[2, 2] * feed, a[3, 2] * feed])[:, None]
    start = random.standard_normal(4)
    time = 0.01 * np.arange(400)
    _, expected, _ = signal.lsim((a, entry, np.eye(4), np.zeros((4, 1))), x, time, X0=start)
    q = found.forced(x) + (found.adjoint @ start)[:, None] * found.free(400)
    np.testing.assert_allclose(found.storeys(q), expected[:, :2].T, atol=1e-11)
    speeds = expected[:, 2:].T + np.array([[feed], [0.0]]) * x
    np.testing.assert_allclose(found.velocities(q, x), speeds, atol=1e-10)


def test_the_stated_uncertainty_is_the_scatter_of_many_recordings() -> None:
    clean, truth, random = recording(constants(), bend=0.0), quantities(constants()), np.random.default_rng(5)
    exact = SensorAccuracy(laser_timing=0.0, laser_linearity=0.0)
    errors, stated = [], []
    for number in range(20):
        noisy = clean.copy()
        noisy[:, 1] += 2e-5 * random.standard_normal(TIME.size)
        # neighbours are alike: an autoregressive noise of the lasers
        white = 1e-5 * random.standard_normal((TIME.size, 2))
        noisy[:, 4:6] += signal.lfilter([1.0], [1.0, -0.95], white, axis=0)
        found = fit_from_scratch(stretch_of(noisy[:, 1], noisy[:, 4:6].T, RATE, on_table=False), setting().masses)
        errors.append(quantities(found.constants) - truth)
        # what is stated hardly differs between recordings
        if number % 3 == 0:
            parts = fit_uncertainty(found, Errors(sensors(exact), QUIET, np.zeros((2, 2))))
            stated.append(np.sqrt(np.diag(parts.own)))
    share = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(np.square(stated), axis=0))
    # root of chi2 over 20 degrees of freedom, between its 0.1 % and 99.9 %
    assert np.all((share > 0.54) & (share < 1.51)), share


@pytest.mark.parametrize("loud_first", [True, False])
def test_noise_counts_when_it_matters(loud_first: bool, let_go: Decay, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.analysis.free_decay.covariance.SEGMENT", 1.0)
    stretch, fit, random = let_go.fit.stretch, let_go.fit, np.random.default_rng(8)
    level = np.geomspace(1e-5, 1e-6, stretch.time.size)[:: 1 if loud_first else -1]
    noise = level * random.standard_normal((300, 2, stretch.time.size))
    moved = fit.moved(noise)
    turn, _ = slopes(fit.constants)
    actual = (moved[:, : turn.shape[1]] @ turn.T).std(axis=0)

    def stated() -> Array:
        errors = Errors(sensors(SensorAccuracy()), 0.0, np.zeros((2, 2)))
        left = [one - np.tensordot(shift, fit.jacobian, 1) for one, shift in zip(noise[:10], moved[:10], strict=True)]
        parts = [fit_uncertainty(replace(fit, residual=each), errors).parts["noise"] for each in left]
        return np.sqrt(np.mean([np.diag(part) for part in parts], axis=0))

    # mode 2 decays sooner: the noise of the beginning determines its damping
    assert stated()[[XI1, XI2]] / actual[[XI1, XI2]] == pytest.approx([1.0, 1.0], rel=0.2)
    monkeypatch.setattr("bench.analysis.free_decay.covariance.MOST_SECTIONS", 1)
    alike = float(stated()[XI2] / actual[XI2])
    assert alike < 0.8 if loud_first else alike > 1.6, alike


def test_the_wander_of_a_clock_is_not_counted_as_noise_as_well(let_go: Decay, monkeypatch: pytest.MonkeyPatch) -> None:
    stretch, fit, random = let_go.fit.stretch, let_go.fit, np.random.default_rng(9)
    speed = np.gradient(fit.fitted, stretch.step, axis=1)
    # the delay of each laser wanders through one measuring period within 2.5 s
    late = 2.5e-4 * ((0.4 * stretch.time + np.array([[0.1], [0.6]])) % 1.0 - 0.5)
    white = 1e-5 * random.standard_normal(speed.shape)
    left = [each - np.tensordot(fit.moved(each[None])[0], fit.jacobian, 1) for each in (white, white + speed * late)]

    def added() -> float:
        """Variance of xi1 that the wander adds to that of the noise, relative to the latter."""
        errors = Errors(sensors(SensorAccuracy()), 0.0, np.zeros((2, 2)))
        parts = [fit_uncertainty(replace(fit, residual=each), errors).parts["noise"][XI1, XI1] for each in left]
        return float(parts[1] / parts[0]) - 1.0

    found = added()
    monkeypatch.setattr("bench.analysis.free_decay.covariance.BESIDE", 0.0)
    assert added() > 4.0 * found > 1.0


def test_weighing_errors_move_the_stiffness_as_stated() -> None:
    signals, off = recording(constants()), 1e-3
    errors = np.diag([0.0004**2, 0.0007**2])
    decay = pulsed_decay(signals, setting(masses_covariance=errors), QUIET, BEGIN)
    for which in range(2):
        masses = [FRAME.m1, FRAME.m2]
        masses[which] += off
        heavier = pulsed_decay(signals, setting(masses=tuple(masses)), QUIET, BEGIN)
        moved = (heavier.quantities - decay.quantities) / off
        np.testing.assert_allclose(
            decay.uncertainty.mass_shift[:, which], moved, rtol=0.02, atol=2e-4 * np.abs(moved).max()
        )
    # with all masses larger by a share all stiffnesses are
    assert decay.uncertainty.mass_shift[:2] @ [FRAME.m1, FRAME.m2] == pytest.approx([FRAME.k1, FRAME.k2], rel=1e-3)
    own = decay.uncertainty.mass_shift @ errors @ decay.uncertainty.mass_shift.T
    np.testing.assert_allclose(decay.uncertainty.parts["masses"], own, rtol=1e-12)


def test_a_slow_timebase_moves_what_has_a_rate_in_it_as_stated() -> None:
    signals, share = recording(constants()), 1e-3
    accuracy = SensorAccuracy(timebase=share)
    decay = pulsed_decay(signals, setting(sensors=sensors(accuracy)), QUIET, BEGIN)
    # the same samples, said to come faster than they did
    fast = setting(sample_rate=RATE * (1.0 + share))
    moved = pulsed_decay(signals, fast, QUIET / (1.0 + share), BEGIN / (1.0 + share)).quantities - decay.quantities
    np.testing.assert_allclose(
        moved / decay.quantities, decay.uncertainty.time_shift / decay.quantities, atol=0.02 * share
    )
    np.testing.assert_allclose(np.diag(decay.uncertainty.parts["timebase"]), decay.uncertainty.time_shift**2)
    assert np.all(np.diag(decay.uncertainty.common) >= decay.uncertainty.time_shift**2)


@cache
def released(c: Constants, drag: float = 0.0) -> Array:
    """Signals of a frame on a locked table whose storey 2 is let go after 3 s; `drag` [N s2/m2] is quadratic, on it.

    Each is integrated once, and cannot be written.
    """
    a, _ = system(c)
    pull = np.array([0.02 * c.k2 / (c.k1 + c.k2), 0.02])

    def rates(_: float, state: Array) -> Array:
        found = a @ state
        found[3] -= drag * abs(state[3]) * state[3] / c.m2
        return found

    after = TIME[TIME >= 3.0] - 3.0
    found = solve_ivp(rates, (0.0, after[-1]), [*pull, 0.0, 0.0], "DOP853", t_eval=after, rtol=1e-10, atol=1e-13)
    moved = np.concatenate((np.tile(pull, (TIME.size - after.size, 1)), found.y[:2].T))
    signals = np.zeros((TIME.size, 6))
    signals[:, 4:6] = moved - pull + 3e-6 * np.random.default_rng(1).standard_normal(moved.shape)
    signals[:, 3] = signals[:, 5] - signals[:, 4]
    signals.setflags(write=False)
    return signals


@pytest.fixture(scope="module")
def let_go() -> Decay:
    return released_decay(released(constants()), setting())


def test_a_frame_let_go_by_hand_is_found_with_the_table_locked(let_go: Decay) -> None:
    truth, decay = quantities(constants()), let_go
    size = np.sqrt(np.diag(decay.uncertainty.own + decay.uncertainty.common))
    assert np.all(np.abs(decay.quantities - truth) < 4.0 * size)
    assert size[[K1, K2, XI1]] / truth[[K1, K2, XI1]] == pytest.approx([0.0, 0.0, 0.0], abs=2e-3)
    assert all(abs(course.slope) < 4.0 * np.sqrt(course.own + course.common) for course in decay.courses)
    # from rest, not from the zero, which was taken while the storey was held
    assert decay.peak == pytest.approx(0.02 * FRAME.k1 / (FRAME.k1 + FRAME.k2), rel=0.1)


def test_quadratic_drag_shows_as_damping_that_grows_with_the_amplitude() -> None:
    c, drag = constants(), 0.04
    decay = released_decay(released(c, drag), setting())
    root = np.sqrt([c.m1, c.m2])
    stiffness = np.array([[c.k1 + c.k2, -c.k2], [-c.k2, c.k2]])
    first = np.linalg.eigh(stiffness / np.outer(root, root))[1][:, 0] / root
    # the energy that drag takes in a cycle is that of a dashpot of 8 / (3 pi) drag omega U2
    expected = 4.0 / (3.0 * pi) * drag * first[1] ** 3 / (first[1] - first[0]) * np.sign(first[1])
    course = decay.courses[0]
    assert course.slope == pytest.approx(abs(expected), rel=0.1)
    assert course.slope > 10.0 * np.sqrt(course.own + course.common)
    assert np.all(np.diff(course.damping) < 0.0)
    assert np.all(np.diff(course.amplitude) < 0.0)


def test_decays_that_scatter_enlarge_the_uncertainty_and_those_that_agree_do_not() -> None:
    own, common = np.diag([1.0, 4.0]), np.array([[0.5, 0.2], [0.2, 0.5]])
    values = [np.array([10.0, 3.0]), np.array([16.0, 3.1]), np.array([4.0, 2.9])]
    found = combine(values, [own, own, 2.0 * own], [common] * 3)
    weights = np.array([1.0, 1.0, 0.5]) / 2.5
    assert found.values[1] == pytest.approx(weights @ [value[1] for value in values])
    spread = ([value[0] for value in values] - weights @ [value[0] for value in values]) ** 2 @ [1.0, 1.0, 0.5]
    assert found.birge[0] == pytest.approx(np.sqrt(spread / 2.0))
    assert found.birge[1] < 1.0
    assert found.own[0, 0] == pytest.approx(found.weights[:, 0] ** 2 @ [1.0, 1.0, 2.0] + found.scatter[0] ** 2)
    # 95 % by Student's t with two degrees of freedom (4.303), of three values 6 apart, is 14.9
    assert 1.96 * found.scatter[0] == pytest.approx(4.303 * 6.0 / np.sqrt(3.0), rel=0.03)
    assert (found.own[1, 1], found.scatter[1]) == (pytest.approx(4.0 / 2.5), 0.0)
    np.testing.assert_allclose(found.common, common)
    alone = combine(values[:1], [own], [common])
    np.testing.assert_array_equal(alone.covariance, own + common)
    assert np.isnan(alone.birge).all()


def test_what_tells_nothing_is_refused() -> None:
    signals = recording(constants())
    lost = signals.copy()
    lost[:600, 5] = np.nan
    with pytest.raises(Unusable, match=r"laser_2 has no value for 3\.8 %"):
        pulsed_decay(lost, setting(), QUIET, BEGIN)
    lost = signals.copy()
    lost[5000:5100, 4:6] = np.nan
    kept = pulsed_decay(lost, setting(), QUIET, BEGIN)
    assert kept.quantities[K1] == pytest.approx(FRAME.k1, rel=2e-5)
    still = np.random.default_rng(2).normal(0.0, 1e-5, signals.shape)
    with pytest.raises(Unusable, match="no release was found"):
        released_decay(still, setting())
    late = still.copy()
    late[-1000:, 5] += 0.01
    with pytest.raises(Unusable, match=r"released 0\.\d s before the end of the recording: release it earlier"):
        released_decay(late, setting())


def test_a_frame_that_is_touched_after_its_release_is_no_free_decay() -> None:
    pushed = released(constants()).copy()
    pushed[:, 4:6] += 0.002 * np.exp(-((TIME - 7.0) ** 2))[:, None] * [0.6, 1.0]
    with pytest.raises(Unusable, match=r"not a free decay of the frame: the fit leaves 0\.45 mm rms"):
        released_decay(pushed, setting())
    # a damping that depends strongly on the amplitude is accepted
    assert released_decay(released(constants(), drag=2.0), setting()).quantities[XI1] > 1.5 * FRAME.xi1


def test_the_linearity_of_a_calibrated_laser_is_that_of_its_calibration() -> None:
    accuracy = SensorAccuracy(laser_linearity=8e-4)
    calibrated = SensorUncertainty(accuracy, (0.2, 0.2), calibration(-0.03, 0.05, rest=0.01))
    for laser in range(2):
        inside, outside = np.array([-0.04, np.nan, 0.04]), np.array([0.0, 0.041])
        assert calibrated.linearity_amplitude(laser, inside) == pytest.approx(np.hypot(np.sqrt(2.0) * 1e-5, 3e-5))
        assert calibrated.linearity_amplitude(laser, outside) == pytest.approx(1.6e-4)
        assert sensors(accuracy).linearity_amplitude(laser, inside) == pytest.approx(1.6e-4)
    # by the covariance, quadratically
    signals = released(constants())
    parts = [
        np.diag(released_decay(signals, setting(sensors=those)).uncertainty.parts["linearity"])
        for those in (sensors(accuracy), calibrated)
    ]
    assert parts[1] == pytest.approx(parts[0] * (np.hypot(np.sqrt(2.0) * 1e-5, 3e-5) / 1.6e-4) ** 2, rel=1e-9)
