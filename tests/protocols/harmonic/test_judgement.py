"""A measured dwell is compared with the branch on which it lies."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from bench.analysis.free_motion import FreeMotion, Rate
from bench.analysis.gain import SensorAccuracy, SteadyPeak
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady import Steadiness
from bench.analysis.unsteady_peaks import UnsteadyPeaks
from protocols.common.sine.settling import Settled
from protocols.harmonic.conditions import Conditions
from protocols.harmonic.judgement import judge
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen

AMPLITUDE = 1.01 * 9.81 / 8.0
OMEGA = 20.0
SPECIMEN = Specimen().coupled(0.25)
PREDICTED = predict_gain(SPECIMEN, OMEGA, AMPLITUDE)
KNOWN = SpecimenKnowledge().only()
"""How well the specimen is known: exactly."""

STEADY = Steadiness(True, 0.0, 0.0, 1)


def _settled(drift: float, u1: float, steadiness: Steadiness = STEADY) -> Settled:
    seen = PeakReadings(drift, 1.0, (-0.8 * drift, 0.2 * drift), (0.0, 0.0), np.zeros((2, 1)), (drift, drift), False)
    return Settled(SteadyPeak(drift, 0.0, 0.0, u1, AMPLITUDE, 0.002, seen, 24), steadiness, 60.0, 0.0, 0.0, 3)


BARE = _settled(PREDICTED.bare.drift, PREDICTED.bare.u1)
RANGES = (0.2, 0.2)
SENSORS = SensorUncertainty(SensorAccuracy(), RANGES)


def conditions(
    known: SpecimenKnowledge = KNOWN, reference: Settled = BARE, sensors: SensorUncertainty = SENSORS
) -> Conditions:
    return Conditions(OMEGA, SPECIMEN, known, reference, sensors)


@pytest.mark.parametrize(("branch", "status"), [("rocking", PointStatus.STEADY), ("resting", PointStatus.RESTING)])
@pytest.mark.parametrize("error", [-0.015, 0.0, 0.015])
def test_each_branch_is_recognised(branch: str, status: PointStatus, error: float) -> None:
    expected = PREDICTED.branches[branch]
    peaks = expected.orbit.peaks
    known = SpecimenKnowledge()
    point = judge(_settled(peaks.drift * (1 + error), peaks.u1), conditions(known), 2)
    assert (point.status, point.layer) == (status, branch)
    assert point.alpha_2_predicted == pytest.approx(expected.alpha_2)
    assert point.agrees is True


EXACT = SensorAccuracy(laser_linearity=0.0, laser_mismatch=0.0, laser_resolution=0.0, table_scale=0.0)


INEXACT, DOUBTFUL = EXACT.model_copy(update={"table_scale": 0.005}), SpecimenKnowledge(stiffness=0.01)


@pytest.mark.parametrize(
    ("accuracy", "known", "side"),
    [
        (EXACT, KNOWN, 1.0),
        (EXACT, DOUBTFUL, -1.0),
        (INEXACT, KNOWN, -1.0),
        (INEXACT, DOUBTFUL, 1.0),
        pytest.param(EXACT, KNOWN, -1.0, marks=pytest.mark.soak),
        pytest.param(EXACT, DOUBTFUL, 1.0, marks=pytest.mark.soak),
        pytest.param(INEXACT, KNOWN, 1.0, marks=pytest.mark.soak),
        pytest.param(INEXACT, DOUBTFUL, -1.0, marks=pytest.mark.soak),
    ],
)
def test_a_difference_beyond_the_uncertainties_of_both_is_flagged(
    accuracy: SensorAccuracy, known: SpecimenKnowledge, side: float
) -> None:
    peaks = PREDICTED.branches["rocking"].orbit.peaks

    def off(share: float) -> HarmonicPoint:
        drift = (1.0 + side * share) * peaks.drift
        return judge(_settled(drift, peaks.u1), conditions(known, sensors=SensorUncertainty(accuracy, RANGES)), 1)

    same = off(0.0)
    measured, predicted = same.alpha_2_uncertainty, same.alpha_2_predicted_uncertainty
    assert measured is not None
    assert predicted is not None
    assert same.alpha_2_predicted is not None
    assert (measured > 0.0, predicted > 0.0) == (accuracy is not EXACT, known is not KNOWN)
    both = hypot(measured, predicted) / same.alpha_2_predicted
    assert off(0.95 * both + 1e-9).agrees is (both > 0.0)
    beyond = off(1.05 * both + 1e-6)
    assert beyond.agrees is False
    assert "the difference from the prediction exceeds the combined uncertainty" in beyond.reason


@pytest.mark.parametrize(("repeats", "words"), [(0, "does not repeat"), (3, "repeats every 3 cycles")])
def test_what_is_not_steady_is_modulated_and_says_how(repeats: int, words: str) -> None:
    peaks = PREDICTED.branches["rocking"].orbit.peaks
    point = judge(_settled(peaks.drift, peaks.u1, Steadiness(False, 0.3, 0.1, repeats)), conditions(), 1)
    assert point.status is PointStatus.MODULATED
    assert words in point.reason
    assert point.agrees is None


def test_a_bare_frame_that_was_not_steady_is_no_reference() -> None:
    peaks = PREDICTED.branches["rocking"].orbit.peaks
    wandering = _settled(PREDICTED.bare.drift, PREDICTED.bare.u1, Steadiness(False, 0.1, 0.1, 0))
    point = judge(_settled(peaks.drift, peaks.u1), conditions(reference=wandering), 1)
    assert point.agrees is None
    assert "bare frame was not steady" in point.reason


def test_a_steady_motion_on_an_unstable_orbit_says_that_it_will_not_last() -> None:
    specimen = Specimen().coupled(0.64)
    predicted = predict_gain(specimen, 12.5, AMPLITUDE)
    assert predicted.rocking is not None
    peaks = predicted.rocking.orbit.peaks
    bare = _settled(predicted.bare.drift, predicted.bare.u1)
    point = judge(_settled(peaks.drift, peaks.u1), Conditions(12.5, specimen, KNOWN, bare, SENSORS), 1)
    assert point.predicted_stable is False
    assert "grow by 0.89 % per cycle on fixed ground" in point.reason
    assert point.table_multiplier is None
    on_table = judge(_settled(peaks.drift, peaks.u1), Conditions(12.5, specimen, KNOWN, bare, SENSORS, Shaker(), 10), 1)
    assert on_table.table_multiplier == pytest.approx(0.9993, abs=1e-4)
    assert "on fixed ground and decay by 0.068 % per cycle on this table" in on_table.reason


def test_a_table_that_is_off_is_told() -> None:
    peaks = PREDICTED.branches["rocking"].orbit.peaks
    good = _settled(peaks.drift, peaks.u1)
    assert judge(good, conditions(), 1).reason == ""
    off = replace(good, amplitude_error=-0.004, phase_error=0.002, peak=replace(good.peak, harmonics=0.013))
    point = judge(off, conditions(), 1)
    assert "the table's amplitude has an error of -0.40 %" in point.reason
    assert "the table's harmonics are 1.3 % of its fundamental" in point.reason
    assert (point.amplitude_error, point.phase_error_rad, point.table_harmonics) == (-0.004, 0.002, 0.013)
    assert point.table_updates == 3


def test_a_resting_block_says_that_the_stable_rocking_motion_was_not_reached() -> None:
    peaks = PREDICTED.branches["resting"].orbit.peaks
    point = judge(_settled(peaks.drift, peaks.u1), conditions(), 6)
    assert "no start reached the stable rocking motion" in point.reason


@pytest.mark.parametrize("off", [0.0, 0.5])
def test_the_orbit_about_which_a_motion_turns_is_compared_with_the_prediction(off: float) -> None:
    peaks = PREDICTED.branches["rocking"].orbit.peaks
    least, mean, greatest = (_settled(ratio * peaks.drift, peaks.u1).peak for ratio in (0.95, 1.0, 1.05))
    turning = replace(
        _settled(1.05 * peaks.drift, peaks.u1, Steadiness(False, 0.1, 0.0, 0)),
        motion=FreeMotion(UnsteadyPeaks(least, mean, greatest), 0, Rate(0.999, 0.001, 2.7)),
        orbit=_settled((1.0 + off) * peaks.drift, peaks.u1).peak,
    )
    point = judge(turning, conditions(SpecimenKnowledge()), 1)
    assert (point.status, point.agrees, point.orbit_agrees) == (PointStatus.MODULATED, None, off == 0.0)
    assert point.alpha_2_orbit == pytest.approx((1.0 + off) * PREDICTED.branches["rocking"].alpha_2)
    assert point.alpha_2_least is not None
    assert point.alpha_2_least < point.alpha_2_orbit or off == 0.0
    assert (point.alpha_2_greatest, point.alpha_2_greatest_uncertainty) == (point.alpha_2, point.alpha_2_uncertainty)
    assert (point.multiplier, point.multiplier_uncertainty) == (0.999, 0.002)
    assert "the mean cycle gives the gain of the orbit" in point.reason
