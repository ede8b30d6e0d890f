"""Steady motions and gain coefficients against tabulated values, closed forms and long runs."""

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.gain import gain_spectrum, predict_gain
from sim.linear import steady_peaks
from sim.rocking import Mode, State, simulate
from sim.specimen import Block, Specimen
from sim.steady import NoOrbit, Orbit, resting_state, rocking_branch, rocking_orbit
from tests.sim.oracle import reference_motion
from tests.sim.runs import A_S


def product_of_multipliers(orbit: Orbit) -> float:
    """r^4 exp(-((c1 + c2)/m1 + c2/m2) T): volume left after a period with two impacts (Liouville)."""
    frame, (c1, c2) = orbit.specimen.frame, orbit.specimen.frame.dashpots
    rate = (c1 + c2) / frame.m1 + c2 / frame.m2
    return orbit.specimen.block.restitution**4 * float(np.exp(-rate * orbit.period))


@pytest.mark.parametrize(
    ("beta", "omega", "alpha_2"),
    [
        (0.40, 16.05, 0.18429),
        (0.40, 13.95, 0.40493),
        (0.40, 17.55, 0.82627),
        (0.25, 17.85, 2.37277),
        (0.64, 19.95, 4.12652),
        (0.97, 19.95, 0.78063),
    ],
)
def test_gain_on_the_rocking_orbit(beta: float, omega: float, alpha_2: float) -> None:
    prediction = predict_gain(Specimen(beta=beta), omega, A_S)
    assert prediction.rocking is not None
    assert prediction.rocking.alpha_2 == pytest.approx(alpha_2, abs=5.1e-6)
    assert prediction.rocking.stable
    product = np.prod(prediction.rocking.orbit.multipliers)
    assert product.real == pytest.approx(product_of_multipliers(prediction.rocking.orbit), rel=1e-8)


@pytest.mark.parametrize("beta", [0.1, 0.64, 1.5])
def test_multipliers_keep_their_product_along_a_branch(beta: float) -> None:
    for orbit in rocking_branch(Specimen(beta=beta), np.linspace(12.0, 21.0, 25), A_S):
        assert np.prod(orbit.multipliers).real == pytest.approx(product_of_multipliers(orbit), rel=1e-8)
        assert orbit.impacts == 2


def test_orbit_closes_in_an_independent_solver() -> None:
    orbit = rocking_orbit(Specimen(beta=0.64), 17.0, A_S)
    start = orbit.start.as_array()
    _, impacts = reference_motion(
        orbit.specimen, lambda t: A_S * float(np.sin(orbit.phase + 17.0 * t)), [0.0, 1.02 * orbit.period], start, 1
    )
    assert impacts[1] == pytest.approx(orbit.period, abs=1e-10)
    assert len(impacts) == 2


def test_a_long_run_settles_on_the_orbit() -> None:
    orbit = rocking_orbit(Specimen(beta=0.4), 16.0, A_S)
    drive = SineProgram([Sweep.dwell(300 * orbit.period, A_S, 16.0)], phase=orbit.phase)
    moved = State.from_array(orbit.start.as_array() * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.02]))
    motion = simulate(orbit.specimen, drive, state=moved, peaks_from=298 * orbit.period)
    left = orbit.multiplier**298
    assert motion.peaks.drift == pytest.approx(orbit.peaks.drift, rel=10.0 * left)
    assert motion.peaks.theta == pytest.approx(orbit.peaks.theta, rel=10.0 * left)


@pytest.mark.parametrize(
    ("beta", "stable", "unstable"),
    [(0.64, [13.2, 13.4, 13.9], [12.9, 13.05, 13.55, 13.8]), (0.97, [13.4, 14.3, 15.5], [13.5, 14.2, 14.4, 15.4])],
)
def test_windows_of_instability(beta: float, stable: list[float], unstable: list[float]) -> None:
    specimen = Specimen(beta=beta)
    for omega in stable + unstable:
        orbit = rocking_orbit(specimen, omega, A_S)
        assert orbit.stable is (omega in stable)
        if not orbit.stable:
            leading = orbit.multipliers[np.abs(orbit.multipliers).argmax()]
            assert 145.0 < abs(np.degrees(np.angle(leading))) < 175.0


def test_no_instability_at_low_stiffness() -> None:
    branch = rocking_branch(Specimen(beta=0.4), np.linspace(12.5, 20.0, 31), A_S)
    assert all(orbit.stable for orbit in branch)
    assert all(0.02 < orbit.peaks.theta < 0.065 for orbit in branch)


def test_the_order_and_the_start_of_a_branch_do_not_matter() -> None:
    specimen = Specimen(beta=0.97)
    omegas = [19.95, 12.5, 16.0, 16.0, 12.6, 20.0]
    for omega, orbit in zip(omegas, rocking_branch(specimen, omegas, A_S), strict=True):
        alone = rocking_orbit(specimen, omega, A_S)
        assert orbit.peaks.drift == pytest.approx(alone.peaks.drift, rel=1e-8)
        assert orbit.start.as_array() == pytest.approx(alone.start.as_array(), abs=1e-9)


def test_an_orbit_is_followed_in_stiffness_and_amplitude_too() -> None:
    near = rocking_orbit(Specimen(beta=0.3), 15.0, A_S)
    target = Specimen(beta=0.8, block=Block(restitution_factor=0.992), d=0.2)
    followed, alone = rocking_orbit(target, 18.0, 1.4 * A_S, near), rocking_orbit(target, 18.0, 1.4 * A_S)
    assert followed.peaks.drift == pytest.approx(alone.peaks.drift, rel=1e-9)


def test_samples_are_one_period_from_the_drives_zero() -> None:
    orbit = rocking_orbit(Specimen(beta=0.4), 16.0, A_S)
    table = orbit.samples(2000)
    assert table.shape == (2000, 4)
    assert (table[0, 0], table[1, 0]) == pytest.approx((0.0, 2.0 * np.pi / 2000))
    assert np.abs(table[:, 3]).max() == pytest.approx(orbit.peaks.theta, rel=1e-4)
    assert np.abs(table[:, 2] - table[:, 1]).max() == pytest.approx(orbit.peaks.drift, rel=1e-4)
    # it closes: the last sample leads back to the first
    assert np.abs(table[0] - 2.0 * table[-1] + table[-2])[1:].max() < 1e-4
    with pytest.raises(InvalidInput, match=r"^n = "):
        orbit.samples(0)


def test_resting_branch_and_its_edge() -> None:
    # the stated grid has steps of 0.09 rad/s: the edge lies within one step below each onset
    for beta, onset in ((0.1, 17.0), (0.25, 18.0), (0.4, 18.8), (0.64, 20.2)):
        assert resting_state(Specimen(beta=beta), onset, A_S) is not None
        assert resting_state(Specimen(beta=beta), onset - 0.2, A_S) is None
    assert all(resting_state(Specimen(beta=0.97), omega, A_S) is None for omega in np.linspace(12.0, 21.0, 40))


def test_a_resting_motion_leaves_the_spring_a_length() -> None:
    """|u1| is 42 mm at (18, 0.25)."""
    assert resting_state(Specimen(beta=0.25, d=0.045), 18.0, A_S) is not None
    assert resting_state(Specimen(beta=0.25, d=0.04), 18.0, A_S) is None
    # without a spring it does not matter
    assert resting_state(Specimen(beta=0.0, d=0.005), 19.0, 0.99 * A_S / 1.01) is not None


def test_resting_branch_has_its_own_gain_and_stays_at_rest() -> None:
    prediction = predict_gain(Specimen(beta=0.25), 18.0, A_S)
    assert prediction.resting is not None
    assert prediction.rocking is not None
    assert prediction.resting.alpha_2 == pytest.approx(3.365, abs=5e-4)
    assert prediction.rocking.alpha_2 == pytest.approx(2.4, abs=0.05)
    assert list(prediction.branches) == ["rocking", "resting"]
    orbit = prediction.resting.orbit
    motion = simulate(orbit.specimen, SineProgram([Sweep.dwell(30.0, A_S, 18.0)], phase=orbit.phase), state=orbit.start)
    assert motion.end.mode is Mode.REST
    assert motion.peaks.drift == pytest.approx(orbit.peaks.drift, rel=1e-9)
    assert np.abs(orbit.samples(500)[:, 1]).max() == pytest.approx(orbit.peaks.u1, rel=1e-4)


def test_resting_multipliers_are_the_decay_of_the_linear_frame() -> None:
    orbit = resting_state(Specimen(beta=0.25), 18.5, A_S)
    assert orbit is not None
    frame, (c1, c2) = orbit.specimen.frame, orbit.specimen.frame.dashpots
    rate = (c1 + c2) / frame.m1 + c2 / frame.m2
    assert np.prod(orbit.multipliers).real == pytest.approx(np.exp(-rate * orbit.period), rel=1e-10)
    assert orbit.stable


def test_an_uncoupled_block_leaves_the_frame_alone() -> None:
    prediction = predict_gain(Specimen(beta=0.0), 16.0, A_S)
    assert prediction.rocking is not None
    assert prediction.rocking.alpha_1 == pytest.approx(1.0, rel=1e-9)
    assert prediction.rocking.alpha_2 == pytest.approx(1.0, rel=1e-9)


def test_spectrum_is_the_single_predictions() -> None:
    specimen, omegas = Specimen(beta=0.64), [12.5, 15.0, 17.5, 20.0]
    for omega, prediction in zip(omegas, gain_spectrum(specimen, omegas, A_S, bare_amplitude=2.0 * A_S), strict=True):
        alone = predict_gain(specimen, omega, A_S)
        assert prediction.rocking is not None
        assert alone.rocking is not None
        assert 2.0 * prediction.rocking.alpha_2 == pytest.approx(alone.rocking.alpha_2, rel=1e-8)
        assert prediction.bare == steady_peaks(specimen, omega, 2.0 * A_S)


def test_where_there_is_no_rocking_orbit_it_is_said() -> None:
    # a hundredth of the amplitude cannot make up for what two impacts take from any motion of this period
    specimen = Specimen(beta=0.64)
    with pytest.raises(NoOrbit, match="omega = 16"):
        rocking_orbit(specimen, 16.0, 0.01 * A_S)
    assert predict_gain(specimen, 16.0, 0.01 * A_S).rocking is None


def test_a_very_unstable_orbit_closes_in_an_independent_solver() -> None:
    # near the resonance of the first mode
    orbit = rocking_branch(Specimen(beta=0.64), np.arange(10.0, 6.89, -0.05), 0.9 * A_S)[-1]
    assert orbit.multiplier > 10.0
    _, impacts = reference_motion(
        orbit.specimen,
        lambda t: 0.9 * A_S * float(np.sin(orbit.phase + orbit.omega * t)),
        [0.0, 1.02 * orbit.period],
        orbit.start.as_array(),
        1,
    )
    assert impacts[1] == pytest.approx(orbit.period, abs=1e-9)
    # the spring is nearly squeezed flat here: the map is too steep for its differences to be exact
    assert np.prod(orbit.multipliers).real == pytest.approx(product_of_multipliers(orbit), rel=1e-3)


def test_leading_multipliers_are_the_fate_of_a_disturbance() -> None:
    orbit = rocking_orbit(Specimen(beta=0.97), 14.8, A_S)
    drive = SineProgram([Sweep.dwell(152.0 * orbit.period, A_S, orbit.omega)], phase=orbit.phase)
    times = np.arange(100.25, 151.0) * orbit.period
    runs: list[np.ndarray] = []
    for moved in (0.0, 1e-9):
        start = State.from_array(orbit.start.as_array() + np.array([0.0, 0.0, 0.0, 0.0, 0.0, moved]))
        samples = simulate(orbit.specimen, drive, state=start, sample_times=times, tolerance=1e-14).samples
        assert samples is not None
        runs.append(samples)
    # once the other pairs have died out, y(k + 2) = 2 Re(mu) y(k + 1) - |mu|^2 y(k) in every component
    left = runs[1] - runs[0]
    terms = np.stack([left[1:-1].ravel(), left[:-2].ravel()], axis=1)
    sum_of_pair, minus_product = np.linalg.lstsq(terms, left[2:].ravel())[0]
    leading = orbit.multipliers[np.abs(orbit.multipliers).argmax()]
    assert np.sqrt(-minus_product) == pytest.approx(orbit.multiplier, rel=1e-4)
    assert sum_of_pair == pytest.approx(2.0 * leading.real, rel=1e-4)


@pytest.mark.parametrize(
    ("specimen", "omega", "amplitude", "item"),
    [
        (Specimen(), 16.0, A_S, "specimen"),
        (Specimen(beta=0.4), 0.0, A_S, "omega"),
        (Specimen(beta=0.4), float("nan"), A_S, "omega"),
        (Specimen(beta=0.4), 16.0, 0.0, "amplitude"),
    ],
)
def test_bad_input_is_refused(specimen: Specimen, omega: float, amplitude: float, item: str) -> None:
    for refused in (rocking_orbit, predict_gain, resting_state):
        with pytest.raises(InvalidInput, match=item):
            refused(specimen, omega, amplitude)
