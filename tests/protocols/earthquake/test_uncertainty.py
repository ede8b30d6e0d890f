"""Measured against predicted, one source of uncertainty at a time, each against a way that draws nothing.

The interval of one source alone is that of its own quantiles, put through the model one by one.
"""

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.gain import SensorAccuracy
from bench.analysis.signals import DRIFT, LASER_2
from bench.analysis.transient_base import BaseMotion
from bench.analysis.transient_peak import TransientPeak
from bench.config.model import BenchConfiguration
from protocols.earthquake import uncertainty
from protocols.earthquake.draws import Predicted
from protocols.earthquake.measurement import overturning_time
from protocols.earthquake.observation import Observed, PeakSeen, observe
from protocols.earthquake.points import _remarks
from protocols.earthquake.uncertainty import Compared, compare
from sim.excitation import SampledRecord
from sim.knowledge import SpecimenUncertainty
from sim.rocking import simulate
from sim.specimen import Frame, Specimen

Array = NDArray[np.float64]

EXACT = SensorAccuracy(
    laser_slope=0.0,
    laser_mismatch=0.0,
    laser_resolution=0.0,
    laser_timing=0.0,
    laser_linearity=0.0,
    table_scale=0.0,
)
COUPLED = Specimen(beta=0.4)


@pytest.fixture(params=[250, pytest.param(600, marks=pytest.mark.soak)])
def draws(request: pytest.FixtureRequest) -> int:
    return int(request.param)


def scatter(draws: int) -> float:
    """Three standard deviations of a half width: with 600 draws, an end of 95 % scatters by 0.11 sigma."""
    return 0.17 * (600.0 / draws) ** 0.5


def base(peak: float, omega: float = 16.0, noise: float = 0.0) -> BaseMotion:
    t = np.arange(0.0, 4.0, 0.002)
    shape = np.sin(omega * t) * np.sin(np.pi * t / t[-1]) ** 2
    return BaseMotion(peak * shape, 0.002, 1.0, np.full(t.size // 2 + 1, noise))


NONE = SpecimenUncertainty(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
"""A specimen that is exactly known."""


def shown(motion: BaseMotion, noise: float = 0.0) -> Observed:
    peak = TransientPeak(0.02, 0.02 * noise, 0.0, 1.0, 1, 0.03, 0)
    seen = PeakSeen(peak, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), 0.0)
    return Observed(motion, seen, seen)


def compared(
    bare: Observed,
    coupled: Observed,
    accuracy: SensorAccuracy = EXACT,
    specimen: SpecimenUncertainty = NONE,
    *,
    n: int,
) -> Compared:
    return compare(bare, coupled, COUPLED, BenchConfiguration(analysis=accuracy, uncertainty=specimen), n, 1)


def gain(coupled: Specimen, under: SampledRecord, bare_under: SampledRecord) -> float:
    return simulate(coupled, under).peaks.drift / simulate(coupled.bare(), bare_under).peaks.drift


def ends(values: Sequence[float]) -> tuple[float, float]:
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


EVENLY = (np.arange(200) + 0.5) / 200.0
"""Probabilities at which a source is taken."""


def test_each_specimen_is_predicted_under_its_own_motion() -> None:
    one, other = base(0.8, 16.0), base(1.1, 11.0)
    found = compared(shown(one), shown(other), n=8)
    expected = gain(COUPLED, other.record, one.record)
    assert found.alpha_2_predicted == pytest.approx(expected, rel=1e-5)
    assert (found.low, found.high) == pytest.approx((expected, expected), rel=1e-5)
    u1 = simulate(COUPLED, other.record).peaks.u1 / simulate(COUPLED.bare(), one.record).peaks.u1
    assert found.alpha_1_predicted == pytest.approx(u1, rel=1e-5)
    for wrong in (gain(COUPLED, other.record, other.record), gain(COUPLED, one.record, one.record)):
        assert abs(wrong / expected - 1.0) > 0.1
    assert found.bench == pytest.approx(0.0, abs=1e-9)


def test_noise_of_the_peaks_alone_is_in_interval_and_bench_uncertainty(draws: int) -> None:
    found = compared(shown(base(0.5), 0.01), shown(base(0.5), 0.02), n=draws)
    assert found.alpha_2_predicted is not None
    half = 1.96 * np.hypot(0.01, 0.02) * found.alpha_2_predicted
    assert found.low == pytest.approx(found.alpha_2_predicted - half, abs=scatter(draws) * half)
    assert found.high == pytest.approx(found.alpha_2_predicted + half, abs=scatter(draws) * half)
    assert found.bench == pytest.approx(half, rel=scatter(draws))
    assert found.budget.dominating == "noise of the peaks"


def test_the_specimen_alone_is_in_the_interval_and_not_in_the_bench_uncertainty(draws: int) -> None:
    motion = base(1.0)
    found = compared(shown(motion), shown(motion), specimen=NONE.model_copy(update={"spring": 0.1}), n=draws)
    betas = COUPLED.beta * (1.0 + 0.1 * (2.0 * EVENLY - 1.0))
    low, high = ends([gain(Specimen(beta=beta), motion.record, motion.record) for beta in betas])
    assert high - low > 0.01
    assert (found.low, found.high) == pytest.approx((low, high), abs=scatter(draws) * 0.5 * (high - low))
    assert found.bench == pytest.approx(0.0, abs=1e-9)
    assert found.budget.dominating == "stiffness of the spring"


def test_both_storeys_stiffness_counts_and_the_spring_keeps_its_own(draws: int) -> None:
    motion = base(0.5)
    found = compared(shown(motion), shown(motion), specimen=NONE.model_copy(update={"stiffness": 0.05}), n=draws)
    frame = COUPLED.frame
    random = np.random.default_rng(3)
    gains = []
    for k1, k2 in 1.0 + 0.05 * random.uniform(-1.0, 1.0, (draws, 2)):
        stiff = Frame(**(frame.model_dump() | {"k1": frame.k1 * k1, "k2": frame.k2 * k2}))
        gains.append(gain(Specimen(frame=stiff, beta=COUPLED.beta / k1), motion.record, motion.record))
    low, high = ends(gains)
    assert (found.low, found.high) == pytest.approx((low, high), abs=2**0.5 * scatter(draws) * 0.5 * (high - low))
    assert found.bench == pytest.approx(0.0, abs=1e-9)


def test_the_scale_of_the_table_alone_is_in_both(draws: int) -> None:
    motion = base(1.3)
    found = compared(shown(motion), shown(motion), accuracy=EXACT.model_copy(update={"table_scale": 0.005}), n=draws)
    scales = [1.0 + 0.005 * NormalDist().inv_cdf(p) for p in EVENLY]
    gains = np.array([gain(COUPLED, *[SampledRecord(s * motion.acceleration, motion.dt)] * 2) for s in scales])
    low, high = ends(gains)
    assert high - low > 0.005
    assert (found.low, found.high) == pytest.approx((low, high), abs=scatter(draws) * 0.5 * (high - low))
    half = np.quantile(np.abs(gains - gain(COUPLED, motion.record, motion.record)), 0.95)
    assert found.bench == pytest.approx(half, rel=1.5 * scatter(draws))


def test_all_sources_at_once_are_drawn_jointly(draws: int) -> None:
    """A linear response: sources in squares. The noise of the motion is told from that of the peaks by itself."""
    quiet = base(0.5, noise=1e-5)
    exact, noisy = (compared(shown(quiet, noise), shown(quiet, noise), n=draws) for noise in (0.0, 0.01))
    assert exact.bench is not None
    assert noisy.bench is not None
    assert noisy.alpha_2_predicted is not None
    peaks = 1.96 * 0.01 * 2**0.5 * noisy.alpha_2_predicted
    assert exact.bench > 0.2 * peaks
    assert noisy.bench == pytest.approx(np.hypot(exact.bench, peaks), rel=1.5 * scatter(draws))
    assert not noisy.chaotic


def test_parts_that_saturate_are_told_not_to_add_up(draws: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A chaotic response: whatever is drawn, the gain is anywhere."""
    random = np.random.default_rng(4)

    def anywhere(*given: object, **_: object) -> Predicted:
        n = given[4]
        assert isinstance(n, int)
        return Predicted((1.0, 1.0), np.ones(n), 1.0 + 0.1 * random.standard_normal(n), np.zeros(0))

    monkeypatch.setattr(uncertainty, "predict_draws", anywhere)
    observed = shown(base(0.5))
    found = compared(observed, observed, n=draws)
    assert found.chaotic
    # five parts of 0.1 would make 0.45; the gain is within 0.2 of the predicted one
    assert found.bench == pytest.approx(1.96 * 0.1, rel=1.5 * scatter(draws))
    assert any("cannot be separated" in said for said in _remarks(found, observed))


def test_the_peak_is_the_fitted_one_and_not_the_largest_sample() -> None:
    rate, rest = 1000.0, 2000
    t = np.arange(0.0, 10.0, 1.0 / rate)
    drift = 0.01 * np.exp(-(((t - 6.0) / 1.0) ** 2)) * np.cos(16.0 * (t - 6.0))
    found, largest = [], []
    for seed in range(8):
        noise = np.random.default_rng(seed).standard_normal((t.size, 6)) * [1e-3, 1e-6, 1e-4, 1e-4, 1e-6, 1e-6]
        signals = noise + np.column_stack((np.zeros((t.size, 2)), 0.5 * drift, drift, 0.5 * drift, 1.5 * drift))
        found.append(observe(signals, rest, rate).drift.peak.value / 0.01)
        largest.append(np.abs(signals[:, DRIFT]).max() / 0.01)
    assert signals[:, LASER_2].max() == pytest.approx(0.015, rel=1e-3)
    assert np.mean(largest) > 1.012
    assert np.mean(found) == pytest.approx(1.0, abs=0.004)


@pytest.mark.parametrize("signals", [np.zeros((0, 6)), np.full((500, 6), np.nan)])
def test_nothing_seen_has_no_overturning_time(signals: Array) -> None:
    assert overturning_time(signals, 500.0, COUPLED) is None
