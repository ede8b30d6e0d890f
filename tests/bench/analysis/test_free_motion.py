"""Motions that do not become steady: peaks, period and rate against the model's own samples and multipliers."""

from math import tau

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.free_motion import CYCLES, free_motion, orbit_peak, rate_of
from bench.analysis.signals import DRIFT, LASER_1, LASER_2, U1
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.made_cycles import WITHOUT_STEPS, pure_cycle

Array = NDArray[np.float64]
RATE = 2000.0
AMPLITUDE = 1.01 * Specimen().uplift_acceleration
NOISE = 1e-6


def cycles_after(beta: float, omega: float, wait: int) -> tuple[list[Cycle], Array]:
    """Cycles after a sweep from above and `wait` cycles, with the lasers' noise, and the drift [m] without it."""
    cycles, drift, _ = motion_after(beta, omega, wait)
    return cycles, drift


def motion_after(beta: float, omega: float, wait: int) -> tuple[list[Cycle], Array, Array]:
    """As `cycles_after`, with the displacement of the first storey [m]."""
    period = tau / omega
    length = (wait + CYCLES + 1) * period
    drive = SineProgram(
        [
            Sweep(12.0, (0.0, 1.2 * AMPLITUDE), (28.0, 28.0)),
            Sweep(2.0 * (28.0 - omega), (1.2 * AMPLITUDE, 1.2 * AMPLITUDE), (28.0, omega)),
            Sweep(5.0, (1.2 * AMPLITUDE, AMPLITUDE), (omega, omega)),
            Sweep.dwell(length, AMPLITUDE, omega),
        ]
    )
    first = drive.duration - length + wait * period
    times = first + np.arange(round(CYCLES * period * RATE) + 1) / RATE
    motion = simulate(Specimen().coupled(beta), drive, sample_times=times, peaks_from=None)
    assert motion.samples is not None
    assert motion.overturned is None
    u1, u2 = motion.samples[:, 0], motion.samples[:, 1]
    signals = np.zeros((u1.size, 7))
    signals[:, [U1, DRIFT, LASER_1, LASER_2]] = np.stack((u1, u2 - u1, u1, u2), axis=1)
    signals += NOISE * np.random.default_rng(0).standard_normal(signals.shape)
    cycles = CycleAnalyser(omega, RATE, 0).push(signals)
    assert len(cycles) == CYCLES
    return cycles, u2 - u1, u1


def within_periods(drift: Array, omega: float) -> Array:
    """Largest magnitude of the drift in each position of a period [m]."""
    return sliding_window_view(np.abs(drift), round(tau / omega * RATE)).max(axis=1)


@pytest.mark.parametrize(("beta", "omega", "wait"), [(0.97, 15.0, 300), (0.64, 12.5, 300), (0.97, 14.7, 200)])
def test_peaks_of_a_motion_beside_an_unstable_orbit(beta: float, omega: float, wait: int) -> None:
    cycles, drift, u1 = motion_after(beta, omega, wait)
    true, found = within_periods(drift, omega), free_motion(cycles, omega, WITHOUT_STEPS)
    peaks = found.peaks
    for measured, expected in ((peaks.least, true.min()), (peaks.mean, true.mean()), (peaks.greatest, true.max())):
        assert measured.drift == pytest.approx(float(expected), rel=1e-3)
    first, second = peaks.greatest.readings.lasers
    assert second - first == pytest.approx(peaks.greatest.drift, abs=2.0 * NOISE)
    top = int(np.abs(drift).argmax())
    side = float(np.sign(drift[top]))
    assert first == pytest.approx(side * float(u1[top]), abs=1e-3 * peaks.greatest.drift)
    # at the largest drift both storeys have the same velocity
    speeds = peaks.greatest.readings.speeds
    velocity = side * float(np.gradient(u1)[top] * RATE)
    assert speeds == pytest.approx((velocity, velocity), abs=0.02 * omega * peaks.greatest.drift)
    assert found.rate is None or not found.rate.decays


def test_a_fit_of_one_cycle_overshoots_the_largest_peak() -> None:
    """The reason why the peaks are those of the samples."""
    cycles, drift = cycles_after(0.97, 14.7, 200)
    assert max(cycle.peak[DRIFT] for cycle in cycles) > 1.1 * np.abs(drift).max()


def test_a_period_of_nine_cycles_is_found() -> None:
    cycles, _ = cycles_after(0.97, 15.0, 300)
    assert free_motion(cycles, 15.0, WITHOUT_STEPS).repeats == 9


def test_a_lost_cycle_hides_neither_period_nor_rate() -> None:
    cycles, _ = cycles_after(0.97, 15.0, 300)
    assert free_motion([*cycles[:40], *cycles[41:]], 15.0, WITHOUT_STEPS).repeats == 9
    near, _ = cycles_after(0.4, 16.0, 10)
    assert rate_of([*near[:20], *near[21:]]) == rate_of(near[21:])


@pytest.mark.parametrize(("beta", "omega", "wait"), [(0.4, 16.0, 10), (0.4, 17.0, 10), (0.25, 17.5, 20)])
def test_the_rate_of_a_slow_approach_is_the_multiplier_of_the_orbit(beta: float, omega: float, wait: int) -> None:
    cycles, _ = cycles_after(beta, omega, wait)
    found = rate_of(cycles)
    orbit = predict_gain(Specimen().coupled(beta), omega, AMPLITUDE).rocking
    assert found is not None
    assert orbit is not None
    assert found.decays
    assert abs(found.modulus - orbit.multiplier) <= 2.0 * found.uncertainty


@pytest.mark.parametrize(
    ("beta", "omega", "wait"), [(0.64, 12.5, 30), (0.64, 12.5, 100), (0.64, 13.05, 60), (0.97, 13.45, 60)]
)
def test_the_mean_cycle_of_a_motion_about_an_unstable_orbit_has_the_peak_of_the_orbit(
    beta: float, omega: float, wait: int
) -> None:
    cycles, _ = cycles_after(beta, omega, wait)
    orbit = predict_gain(Specimen().coupled(beta), omega, AMPLITUDE).rocking
    found = orbit_peak(cycles, free_motion(cycles, omega, WITHOUT_STEPS), omega)
    assert orbit is not None
    assert found is not None
    assert not orbit.stable
    assert found.drift == pytest.approx(orbit.orbit.peaks.drift, rel=1e-3)
    assert abs(found.drift - orbit.orbit.peaks.drift) <= 2.0 * np.hypot(found.scatter, found.transient)
    assert found.transient > 1e-4 * found.drift


def test_a_motion_far_from_the_orbit_says_nothing_of_its_peak() -> None:
    cycles, _ = cycles_after(0.97, 15.0, 300)
    assert orbit_peak(cycles, free_motion(cycles, 15.0, WITHOUT_STEPS), 15.0) is None


def pure(amplitudes: NDArray[np.complex128]) -> list[Cycle]:
    """Cycles whose lasers, first storey and drift have these complex amplitudes."""
    return [pure_cycle(k, np.full(7, each)) for k, each in enumerate(amplitudes)]


@pytest.mark.parametrize("modulus", [0.95, 0.999, 1.02])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_the_multiplier_of_a_linear_map_is_not_biased_by_noise(modulus: float, noise: float) -> None:
    random = np.random.default_rng(4)
    errors = list[float]()
    # without noise all are alike
    for _ in range(40 if noise else 1):
        steps = (modulus * np.exp(2.8j)) ** np.arange(CYCLES)
        disturbed = noise * (random.standard_normal((CYCLES, 2)) @ np.array([1.0, 1.0j]))
        found = rate_of(pure(1.0 + 0.02 * steps + disturbed))
        assert found is not None
        assert found.angle == pytest.approx(2.8, abs=0.01 if noise else 1e-9)
        errors.append((found.modulus - modulus) / max(found.uncertainty, 1e-9))
    assert np.abs(errors).max() < (5.0 if noise else 1.0)
    assert abs(np.mean(errors)) < 1.0


def test_white_noise_has_no_rate_and_no_period() -> None:
    random = np.random.default_rng(5)
    found = free_motion(
        pure(1.0 + 0.05 * (random.standard_normal((CYCLES, 2)) @ np.array([1.0, 1.0j]))), 15.0, WITHOUT_STEPS
    )
    assert (found.rate, found.repeats) == (None, 0)


@pytest.mark.parametrize("deviation", [0.05, 0.15, 0.3])
@pytest.mark.parametrize("cycles", [60, 96])
def test_a_slow_approach_from_one_side_says_nothing_of_the_orbit(deviation: float, cycles: int) -> None:
    """The mean of the cycles is beside the orbit, and the second direction of the changes is noise."""
    random = np.random.default_rng(3)
    for _ in range(8):
        steps = 1.0 + deviation * 0.99 ** np.arange(cycles)
        disturbed = pure(steps + 4e-5 * (random.standard_normal((cycles, 2)) @ np.array([1.0, 1.0j])))
        found = free_motion(disturbed, 16.0, WITHOUT_STEPS)
        assert found.rate is None or found.rate.uncertainty <= 0.1
        assert orbit_peak(disturbed, found, 16.0) is None
