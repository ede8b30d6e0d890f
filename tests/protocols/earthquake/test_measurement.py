"""Uncertainty, overturning time, running gain and the statement, each against what is known without them."""

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.gain import SensorAccuracy
from bench.analysis.sensor_uncertainty import LINEARITY, SensorUncertainty
from bench.analysis.signals import U1
from bench.analysis.transient_base import BaseMotion
from bench.analysis.transient_peak import TransientPeak
from protocols.earthquake.campaign import check_statement
from protocols.earthquake.draws import predict_draws
from protocols.earthquake.measurement import STEP, GainMonitor, History, overturning_time
from protocols.earthquake.observation import PeakSeen, observe
from protocols.earthquake.uncertainty import drift_errors
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.gain import seismic_curve
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen

Array = NDArray[np.float64]

NONE = SensorAccuracy(
    laser_slope=0.0,
    laser_mismatch=0.0,
    laser_resolution=0.0,
    laser_timing=0.0,
    laser_linearity=0.0,
    table_scale=0.0,
)
RANGES = (0.2, 0.2)
CERTAIN = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)


def seen(drift: float, lasers: tuple[float, float], noise: float = 0.0) -> PeakSeen:
    peak = TransientPeak(drift, noise, 0.0, 1.0, 1, 0.03, 0)
    return PeakSeen(peak, lasers, (0.0, 0.0), (0.0, 0.0), 0.0)


def spread(bare: PeakSeen, coupled: PeakSeen, accuracy: SensorAccuracy) -> float:
    errors = np.sum(
        list(drift_errors((bare, coupled), SensorUncertainty(accuracy, RANGES), 20_000, 1).values()), axis=0
    )
    return float(np.std((1.0 + errors[1]) / (1.0 + errors[0])))


def test_what_both_tests_share_cancels_in_their_ratio() -> None:
    linear = NONE.model_copy(update={"laser_linearity": 0.0008})
    one, like = seen(0.02, (0.005, 0.025)), seen(0.02, (0.005, 0.025))
    # rounding of the draws of each laser
    assert spread(one, like, linear) < 1e-15
    # other readings: a curve of unknown shape may have opposite errors at the peak and at rest, and independent ones at
    # the two peaks
    errors = drift_errors((one, seen(0.01, (0.0, 0.01))), SensorUncertainty(linear, RANGES), 20_000, 2)
    assert all(np.abs(each).max() == 0.0 for name, each in errors.items() if name != LINEARITY)
    height = 0.0008 * RANGES[0] / np.sqrt(2.0)
    for found, size, lasers in zip(errors[LINEARITY], (0.02, 0.01), (2, 1), strict=True):
        independent = np.sqrt(2.0 * lasers) * height / size
        assert 0.7 * independent < found.std() < 1.05 * np.sqrt(2.0) * independent
    ratio = (1.0 + errors[LINEARITY][1]) / (1.0 + errors[LINEARITY][0])
    assert ratio.std() > np.sqrt(2.0) * height / 0.01
    mismatch = NONE.model_copy(update={"laser_mismatch": 0.001})
    assert spread(one, seen(0.01, (0.0025, 0.0125)), mismatch) == pytest.approx(0.0, abs=1e-9)


def test_what_they_do_not_share_adds_up_in_squares() -> None:
    one, other = seen(0.02, (0.0, 0.0), noise=2e-5), seen(0.01, (0.0, 0.0), noise=2e-5)
    assert spread(one, other, NONE) == pytest.approx(np.hypot(1e-3, 2e-3), rel=0.03)


def base(peak: float, noise: float = 0.0) -> BaseMotion:
    t = np.arange(0.0, 6.0, 0.002)
    shape = np.sin(16.0 * t) * np.sin(pi * t / t[-1]) ** 2
    return BaseMotion(peak * shape, 0.002, 1.0, np.full(t.size // 2 + 1, noise))


def test_a_certain_specimen_under_a_certain_motion_has_one_gain() -> None:
    motion, coupled = base(1.4), Specimen(beta=0.4)
    found = predict_draws(motion, motion, coupled, CERTAIN, 4, 1)
    (gain,) = seismic_curve(coupled, motion.record, [0.4])
    assert gain.alpha_2 is not None
    np.testing.assert_allclose(found.alpha_2, gain.alpha_2, rtol=1e-5)
    assert found.nominal == pytest.approx((gain.alpha_1, gain.alpha_2), rel=1e-5)
    assert (found.chance, found.times.size) == (0.0, 0)


def test_a_common_scale_cancels_while_the_block_rests_and_not_when_it_rocks() -> None:
    quiet, strong, coupled = base(0.5), base(1.6), Specimen(beta=0.4)
    resting = predict_draws(quiet, quiet, coupled, CERTAIN, 8, 1, table_scale=0.01)
    rocking = predict_draws(strong, strong, coupled, CERTAIN, 8, 1, table_scale=0.01)
    assert np.std(resting.alpha_2) < 1e-6
    assert np.nanstd(rocking.alpha_2) > 1e-2


def test_toppled_draws_are_counted_and_timed() -> None:
    found = predict_draws(base(6.0), base(6.0), Specimen(beta=0.25), CERTAIN, 3, 1)
    assert found.chance == 1.0
    assert np.isnan(found.nominal).all()
    assert found.times.shape == (3,)
    assert 0.0 < found.times.min() <= found.times.max() < 6.0


def test_the_overturning_time_is_that_of_the_step_in_the_first_storey() -> None:
    """The block leans over within half a second and stays there; the frame swings at both of its modes."""
    rate, specimen = 500.0, Specimen(beta=0.25)
    t = np.arange(0.0, 12.0, 1.0 / rate)
    lean = 0.35 * np.clip((t - 9.5) / 0.5, 0.0, 1.0)
    offset = specimen.k_c * 0.2 * np.sin(lean) / (specimen.frame.k1 + specimen.k_c)
    signals = np.zeros((t.size, 6))
    signals[:, U1] = -offset + 0.004 * np.sin(6.3 * t) + 0.003 * np.sin(16.3 * t)
    assert overturning_time(signals, rate, specimen) == pytest.approx(9.75, abs=0.3)


def test_the_running_gain_is_the_ratio_of_the_peaks_so_far() -> None:
    rate = 1000.0
    random = np.random.default_rng(1)
    bare, coupled = np.cumsum(random.standard_normal((2, 4000)), axis=1) * 1e-4
    predicted = tuple(History(np.cumsum(random.standard_normal(400)) * 1e-4) for _ in range(2))
    watch = GainMonitor("made", 0.25, rate, bare, 1e-6, (predicted[0], predicted[1]))
    for end in range(100, 4001, 100):
        signals = np.zeros((100, 6))
        signals[:, 3] = coupled[end - 100 : end]
        told = watch(signals)
        assert told.seconds == pytest.approx(end / rate)
        assert told.drift_peak == np.abs(coupled[:end]).max()
        assert told.alpha_2 == pytest.approx(np.abs(coupled[:end]).max() / np.abs(bare[:end]).max())
        place = round(told.seconds / STEP)
        if place < 400:
            peaks = [np.abs(each.drift[: place + 1]).max() for each in predicted]
            assert told.predicted == pytest.approx(peaks[1] / peaks[0])


def test_no_gain_is_told_before_the_bare_frame_moved_or_for_a_toppled_prediction() -> None:
    watch = GainMonitor("made", 0.25, 100.0, np.zeros(100), 1e-6, (History(np.ones(100)), History(np.ones(20))))
    told = [watch(np.full((10, 6), 1e-3)) for _ in range(10)]
    assert np.isnan([each.alpha_2 for each in told]).all()
    alone = GainMonitor("made", None, 100.0)(np.full((10, 6), 2e-3))
    assert (alone.drift_peak, alone.beta) == (2e-3, None)
    assert np.isnan([alone.alpha_2, alone.predicted]).all()


def test_a_record_observed_whole() -> None:
    """Peaks and the lasers at them, of signals made from a known motion."""
    rate, rest = 1000.0, 2000
    t = np.arange(0.0, 12.0, 1.0 / rate)
    bell = np.exp(-(((t - 6.0) / 1.0) ** 2))
    x, u1, drift = 0.004 * bell * np.sin(12.0 * t), -0.006 * bell, 0.015 * bell
    signals = np.column_stack((np.gradient(np.gradient(x, t), t), x, u1, drift, x + u1, x + u1 + drift))
    signals += np.array([1e-3, 1e-7, 1e-6, 1e-6, 1e-6, 1e-6]) * np.random.default_rng(1).standard_normal(signals.shape)
    found = observe(signals, rest, rate)
    assert found.drift.peak.value == pytest.approx(0.015, rel=1e-3)
    assert (found.u1.peak.value, found.u1.peak.sign) == (pytest.approx(0.006, rel=1e-3), -1)
    table = 0.004 * np.sin(72.0)
    assert found.drift.lasers == pytest.approx((table - 0.006, table + 0.009), abs=2e-4)
    assert found.u1.table == pytest.approx(-table, abs=2e-4)


def test_a_laser_without_a_value_at_the_peak_of_u1_is_named() -> None:
    """Laser 2 is silent while storey 1 has its largest swing; the drift has its own elsewhere."""
    rate, rest = 1000.0, 2000
    t = np.arange(0.0, 12.0, 1.0 / rate)
    early, late = (np.exp(-(((t - middle) / 0.5) ** 2)) for middle in (5.0, 8.0))
    u1, drift = -0.006 * early, 0.015 * late
    signals = np.column_stack((0.1 * early, 0.004 * early, u1, drift, u1, u1 + drift))
    signals += np.array([1e-3, 1e-7, 1e-6, 1e-6, 1e-6, 1e-6]) * np.random.default_rng(1).standard_normal(signals.shape)
    signals[4800:5200, 3] = signals[4800:5200, 5] = np.nan
    with pytest.raises(InvalidInput, match=r"laser_2.*around the peak"):
        observe(signals, rest, rate)


def test_the_statement_falls_as_the_numbers_do() -> None:
    def row(record: str, beta: float, gain: float | None, status: str = "measured") -> dict[str, object]:
        return {
            "record": record,
            "beta": beta,
            "status": status,
            "alpha_2": gain,
            "alpha_2_uncertainty": None if gain is None else 0.01,
            "alpha_2_predicted": gain,
            "alpha_2_target": gain,
        }

    good = [row("a", 0.25, 0.5), row("a", 0.97, 0.8)]
    found = check_statement(good, (1.5, 25.0))["measured"]
    assert [found[name] for name in ("below_one", "around_half", "towards_one")] == ["holds"] * 3
    bad = [*good, row("b", 0.25, 1.2), row("b", 0.97, 1.6), row("c", 0.25, 0.995), row("c", 0.97, None, "overturned")]
    found = check_statement(bad, (1.5, 25.0))["measured"]
    assert (found["below_one"], found["towards_one"]) == ("does not hold", "does not hold")
    verdicts = {record["record"]: record for record in found["records"]}
    assert verdicts["a"]["below_one"] == "holds"
    assert verdicts["b"]["towards_one"] == "does not hold"
    # a block that topples is a failure of alpha_2 < 1
    assert (verdicts["c"]["below_one"], verdicts["c"]["towards_one"]) == ("does not hold", "undecided")
    assert verdicts["c"]["toppled"] == [0.97]
    unsure = [row("d", 0.25, 0.995), row("d", 0.64, 0.8), row("d", 0.97, None, "not played")]
    for source, verdict in (
        ("measured", "undecided"),
        ("predicted for the achieved motion", "holds"),
        ("predicted for the requested motion", "does not hold"),
    ):
        assert check_statement(unsure, (1.5, 25.0))[source]["below_one"] == verdict
    assert check_statement([row("e", 0.25, None, "not played")], (1.5, 25.0))["measured"]["below_one"] == "undecided"


def test_a_draw_of_the_motion_has_the_stated_noise() -> None:
    motion = base(0.0, noise=4e-8)
    drawn = np.array([motion.draw(np.random.default_rng(k)).acceleration for k in range(40)])
    # white to half the rate: variance = density times bandwidth
    assert drawn.std() == pytest.approx(np.sqrt(4e-8 * 250.0), rel=0.02)
    assert isinstance(motion.record, SampledRecord)
