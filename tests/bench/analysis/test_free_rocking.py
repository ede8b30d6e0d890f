"""What the analysis of free rocking finds in recordings whose motion is known in closed form."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from bench.analysis.free_rocking.findings import LaserErrors, Tilt, analyse_tilt, combined, findings
from bench.analysis.free_rocking.fit import ALPHA as ALPHA_ROW
from bench.analysis.free_rocking.fit import BEND_2, START, P, R
from bench.analysis.free_rocking.points import find_points, functional_uncertainty
from bench.analysis.free_rocking.swings import NotRocking, Recording, find_swings
from bench.analysis.gain import SensorAccuracy
from sim import block_face
from sim.free_rocking import FreeRocking
from tests.rocking import ALPHA, BLOCK, HEIGHT, R_TH, RATE, SPECIMEN, Shown, motion, recording
from tests.rocking import P as P_TRUE

LEAST = 0.006
PERFECT = SensorAccuracy(laser_slope=0.0, laser_linearity=0.0, laser_timing=0.0)


def tilt(of: FreeRocking, shown: Shown | None = None, seed: int = 1) -> Tilt:
    return analyse_tilt(recording(of, shown, seed), SPECIMEN, LEAST)


def test_impacts_and_turning_points_are_where_the_closed_form_has_them() -> None:
    true = motion(-0.5)
    seen = recording(true, Shown(noise=1e-9))
    swings = find_swings(seen, LEAST)
    points = find_points(seen, swings, 0.003)
    count = swings.crossings.size
    assert true.amplitudes[count] >= LEAST > true.amplitudes[count + 1]
    np.testing.assert_allclose(points.impacts, true.impacts[:count], atol=5e-5)
    known = (true.sides * true.amplitudes)[1 : count + 1]
    np.testing.assert_allclose(points.amplitudes, known, rtol=2e-5)
    assert swings.held == pytest.approx(true.tilt, rel=1e-5)


def test_a_block_that_was_lowered_by_hand_is_refused_although_it_swung_to_the_other_side() -> None:
    times = np.arange(0.0, 8.0, 1.0 / RATE)
    angle = np.interp(times, [0.0, 2.0, 4.0, 4.5], [0.06, 0.06, -0.5 * LEAST, 0.0])
    seen = Recording(block_face.displacement(angle, HEIGHT, BLOCK), RATE, BLOCK, HEIGHT)
    with pytest.raises(NotRocking, match=r"lowered by hand, and swung to -0\.0030 rad only: let it go"):
        analyse_tilt(seen, SPECIMEN, LEAST)


@pytest.mark.parametrize("share", [0.35, -0.6])
def test_without_errors_of_the_laser_everything_comes_out(share: float) -> None:
    true = motion(share)
    found = tilt(true, Shown(noise=1e-8, bend=0.2))
    fit = found.fit
    assert fit.values[R] == pytest.approx(true.restitution, rel=1e-7)
    assert (fit.values[ALPHA_ROW], fit.values[P]) == pytest.approx((ALPHA, P_TRUE), rel=1e-5)
    assert (fit.motion.tilt, fit.values[START]) == pytest.approx((true.tilt, true.start), rel=1e-5)
    assert fit.values[BEND_2] == pytest.approx(0.2, rel=1e-3)
    assert found.relation.restitution == pytest.approx(true.restitution, rel=1e-5)
    np.testing.assert_allclose(found.relation.each, true.restitution, atol=3e-4)
    assert found.push == pytest.approx(0.0, abs=5e-3)


def test_a_scale_reaches_the_angle_and_neither_restitution_nor_size() -> None:
    true = motion(0.5)
    plain, scaled = (tilt(true, Shown(noise=1e-8, scale=scale)).fit.values for scale in (1.0, 1.01))
    assert scaled[ALPHA_ROW] / plain[ALPHA_ROW] == pytest.approx(1.01, rel=1e-4)
    assert scaled[R] == pytest.approx(plain[R], abs=2e-6)
    assert scaled[P] == pytest.approx(plain[P], rel=2e-4)


def test_the_filter_cards_delay_the_motion_and_change_nothing_else() -> None:
    true = motion(0.5)
    seen = recording(true, Shown(noise=1e-8))
    card = signal.butter(4, 100.0, fs=RATE, output="sos")
    started = signal.sosfilt_zi(card) * seen.displacement[0]
    filtered, _ = signal.sosfilt(card, seen.displacement, zi=started)
    values = analyse_tilt(replace(seen, displacement=np.asarray(filtered)), SPECIMEN, LEAST).fit.values
    delay = 1.0 / (2.0 * RATE * np.tan(np.pi * 100.0 / RATE) * np.sin(np.pi / 8.0))
    assert values[START] - true.start == pytest.approx(delay, abs=1e-5)
    assert values[R] == pytest.approx(true.restitution, abs=1e-6)
    assert values[P] == pytest.approx(P_TRUE, rel=1e-4)


def test_single_samples_may_be_missing() -> None:
    true = motion(0.5)
    seen = recording(true, Shown(noise=1e-7))
    shown = seen.displacement.copy()
    shown[[0, 7000, 9003, -1]] = np.nan
    shown[8000:8010] = np.nan
    assert analyse_tilt(replace(seen, displacement=shown), SPECIMEN, LEAST).fit.values[R] == pytest.approx(
        true.restitution, abs=1e-6
    )


def test_a_push_at_the_release_is_noticed_and_does_no_harm() -> None:
    """A release at speed is a release from rest at a larger tilt, seen from the moment of the hand's tilt on."""
    true = motion(0.5)
    seen = recording(true, Shown(noise=1e-7))
    held = int(np.argmax(np.abs(true.angle(seen.times)) < 0.85 * abs(true.tilt)))
    shown = seen.displacement.copy()
    shown[:held] = shown[held]
    found = analyse_tilt(replace(seen, displacement=shown), SPECIMEN, LEAST)
    # a sample later the tilt is 0.2 % less
    assert found.push == pytest.approx(1.0 / 0.85 - 1.0, abs=0.003)
    assert found.fit.values[R] == pytest.approx(true.restitution, abs=1e-6)


class Scattered(FreeRocking):
    """Every impact has a restitution of its own, scattered by 0.4 %."""

    @cached_property
    def energies(self) -> np.ndarray:
        alike = FreeRocking(self.alpha, self.p, self.restitution, self.tilt).energies
        random = np.random.default_rng(round(1e4 * self.start))
        each = self.restitution * (1.0 + 0.004 * random.standard_normal(alike.size - 1))
        return alike[0] * np.concatenate(([1.0], np.cumprod(each**2)))


def test_impacts_that_differ_widen_the_uncertainty() -> None:
    r = 0.992 * R_TH
    motions = [
        Scattered(ALPHA, P_TRUE, r, share * ALPHA, 2.5 + 0.01 * number)
        for number, share in enumerate((0.35, -0.35, 0.45, -0.45, 0.6, -0.6))
    ]
    found = findings([tilt(each) for each in motions], LaserErrors(SensorAccuracy(), 0.2), HEIGHT, 0.001)
    for value in (found.motion, found.relation):
        assert abs(value.value - r) < 3.0 * value.uncertainty
        assert 1e-4 < value.uncertainty < 3e-3
    assert found.motion.birge > 3.0
    # a phase adds up what the impacts differ by, a size does not
    assert found.by_amplitudes
    assert found.restitution is found.relation


@pytest.mark.parametrize("trend", [0.0, 0.01])
def test_a_trend_is_found_where_there_is_one(trend: float) -> None:
    found = [tilt(motion(share, trend=trend), seed=seed) for seed, share in enumerate((0.4, -0.5, 0.6))]
    result = findings(found, LaserErrors(PERFECT, 0.2), HEIGHT, 0.0).trend
    # a single step from no trend: exact to first order
    assert result.value == pytest.approx(trend, abs=3.0 * result.uncertainty + 0.1 * trend)
    assert (abs(result.value) > 5.0 * result.uncertainty) is (trend > 0.0)


def test_stated_uncertainties_are_those_of_repetition() -> None:
    """Noise and the steps of a laser's output, filtered together: errors of 14 recordings against what each says."""
    true = motion(0.5)
    card = signal.butter(4, 100.0, fs=RATE, output="sos")
    errors, stated = [], []
    for seed in range(14):
        start = replace(true, start=2.5 + 0.01 * seed)
        seen = recording(start, Shown(noise=5e-6, step=4.9e-5), seed)
        started = signal.sosfilt_zi(card) * seen.displacement[0]
        filtered, _ = signal.sosfilt(card, seen.displacement, zi=started)
        found = analyse_tilt(replace(seen, displacement=np.asarray(filtered)), SPECIMEN, LEAST)
        values, (spread, _) = found.fit.values, LaserErrors(PERFECT, 0.2).noise_and_timing(found.fit)
        relation = found.relation
        errors.append([values[R] - true.restitution, values[P] - P_TRUE, relation.restitution - true.restitution])
        stated.append([spread[R], spread[P], relation.uncertainty])
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(np.square(stated), axis=0))
    # of 14, the ratio scatters by 20 %
    assert np.all((ratio > 0.6) & (ratio < 1.45)), ratio


def test_errors_of_the_laser_are_carried_as_large_as_they_are() -> None:
    """The linearity error of many lasers put on one motion: scatter of r against the part that is stated for it."""
    true, laser = motion(0.5), LaserErrors(SensorAccuracy(laser_timing=0.0), 0.2)
    seen = recording(true, Shown(noise=1e-8, offset=0.0))
    plain = analyse_tilt(seen, SPECIMEN, LEAST)
    stated = [
        np.linalg.norm(laser.linearity(plain.fit)[R]),
        np.linalg.norm(laser.of_relation(plain.relation, plain.fit)),
    ]
    random, shifts = np.random.default_rng(3), []
    for _ in range(10):
        turned = 2 * np.pi * (random.uniform(0.5, 3.0) * seen.displacement / 0.2 + random.uniform())
        bent = replace(seen, displacement=seen.displacement + 0.0008 * 0.2 * np.sin(turned))
        found = analyse_tilt(bent, SPECIMEN, LEAST)
        shifts.append([found.fit.values[R] - true.restitution, found.relation.restitution - true.restitution])
    ratio = np.sqrt(np.mean(np.square(shifts), axis=0)) / stated
    assert np.all((ratio > 0.6) & (ratio < 1.6)), ratio


def test_a_delay_that_falls_back_moves_r_as_stated_and_is_not_noise() -> None:
    true, laser = motion(0.5), LaserErrors(SensorAccuracy(laser_linearity=0.0), 0.2)
    plain = tilt(true, Shown(noise=5e-6))
    random, shifts, stated = np.random.default_rng(5), list[float](), list[NDArray[np.float64]]()
    for _ in range(10):
        rate, phase = random.uniform(-0.2, 0.2), random.uniform()
        times = plain.recording.times
        late = np.interp(times - 2.5e-4 * ((rate * times + phase) % 1.0), times, plain.recording.displacement)
        fit = analyse_tilt(replace(plain.recording, displacement=late), SPECIMEN, LEAST).fit
        shifts.append(float(fit.values[R]) - true.restitution)
        stated.append(laser.noise_and_timing(fit)[:, R])
    noise, timing = np.array(stated).T
    assert np.sqrt(np.mean((shifts / np.hypot(noise, timing)) ** 2)) == pytest.approx(1.0, abs=0.4)
    # the residual is that of the delays, which count once
    assert np.linalg.norm(noise) < 0.5 * np.linalg.norm(timing)
    # a clock that does not wander leaves less
    assert np.linalg.norm(laser.noise_and_timing(plain.fit)[:, R]) < 0.3 * timing.max()


def test_the_uncertainty_of_a_weighted_sum_counts_what_neighbours_share() -> None:
    random, weights, kernel = np.random.default_rng(2), np.ones(400), np.ones(20) / 20.0
    rows = [np.convolve(random.standard_normal(419), kernel, "valid") for _ in range(300)]
    known = float(np.std([row.sum() for row in rows]))
    stated = float(np.mean([functional_uncertainty(weights, row, 0) for row in rows]))
    # without correlation it would be a fifth of it
    assert stated == pytest.approx(known, rel=0.25)


def test_values_that_scatter_more_than_they_promise_are_not_better_known_for_it() -> None:
    nothing = np.zeros((4, 2))
    quiet = combined([1.0, 1.1, 0.9, 1.0], [0.1] * 4, [0.0] * 4, nothing, 0.0)
    assert (quiet.value, quiet.scatter) == (pytest.approx(1.0), 0.0)
    assert quiet.uncertainty == pytest.approx(0.05)
    loud = combined([1.0, 3.0, -1.0, 1.0], [0.1] * 4, [0.0] * 4, nothing, 0.0)
    # Student's t of three degrees of freedom at 97.5 %, from its table
    scatter = np.sqrt(np.var([1.0, 3.0, -1.0, 1.0], ddof=1) / 4.0 - 0.05**2)
    assert loud.uncertainty == pytest.approx(np.hypot(0.05, 3.18245 / 1.95996 * scatter), rel=1e-5)
    common = combined([1.0, 1.0], [0.1, 0.3], [0.0] * 2, np.array([[0.2], [0.2]]), 0.1)
    assert (common.linearity, common.scale) == (pytest.approx(0.2), 0.1)
    assert common.value == pytest.approx(1.0)
    assert np.isnan(combined([1.0], [0.1], [0.0], np.zeros((1, 2)), 0.0).birge)


@pytest.mark.parametrize(
    ("seconds", "changed", "says"),
    [
        (2.0, {}, "at the beginning is too small"),
        (6.0, {}, "did not come to rest"),
        (None, {"lost": True}, "no valid reading at 3.00 s"),
        (None, {"still": True}, "at the beginning is too small"),
        (None, {"least": 0.05}, "sufficiently large impacts"),
    ],
)
def test_what_is_no_free_rocking_is_told(seconds: float | None, changed: dict[str, object], says: str) -> None:
    seen = recording(motion(0.5))
    shown = seen.displacement.copy()
    if seconds is not None:
        shown = shown[: round(seconds * RATE)]
    if "lost" in changed:
        shown[6000:6011] = np.nan
    if "still" in changed:
        shown[:] = 0.0
    with pytest.raises(NotRocking, match=says):
        analyse_tilt(replace(seen, displacement=shown), SPECIMEN, float(changed.get("least", LEAST)))  # type: ignore[arg-type]


def test_another_motion_is_not_taken_for_rocking() -> None:
    times = np.arange(0.0, 24.0, 1.0 / RATE)
    since = np.maximum(times - 2.5, 0.0)
    swing = 0.015 * np.exp(-0.12 * since) * np.cos(6.0 * since) * (since < 18.0)
    with pytest.raises(NotRocking, match="rock"):
        analyse_tilt(replace(recording(motion(0.5)), displacement=swing), SPECIMEN, LEAST)


def test_one_tilt_comes_to_a_ratio() -> None:
    found = findings([tilt(motion(0.5, factor=0.985))], LaserErrors(SensorAccuracy(), 0.2), HEIGHT, 0.001)
    r = found.restitution
    assert abs(r.value / R_TH - 0.985) < 3.0 * r.uncertainty < 1e-3
    assert set(r.parts()) == {"noise", "timing", "linearity", "scale", "scatter"}
    assert found.alpha.scale > 0.003 * ALPHA
