"""A measured dwell is compared with the layer on which it lies."""

from dataclasses import replace

import pytest

from bench.analysis.gain import SensorAccuracy, SteadyPeak
from bench.analysis.steady import Steadiness
from protocols.harmonic.judge import judge
from protocols.harmonic.point import PointStatus
from protocols.harmonic.settle import Settled
from sim.gain import predict_gain
from sim.specimen import Specimen

AMPLITUDE = 1.01 * 9.81 / 8.0
OMEGA = 20.0
SPECIMEN = Specimen().coupled(0.25)
PREDICTED = predict_gain(SPECIMEN, OMEGA, AMPLITUDE)
STEADY = Steadiness(True, 0.0, 0.0, 1)


def _settled(drift: float, u1: float, steadiness: Steadiness = STEADY) -> Settled:
    return Settled(SteadyPeak(drift, 0.0, u1, AMPLITUDE, 0.002, 0.007, 0.009, 24), steadiness, 60.0, 0.0, 0.0, 3)


BARE = _settled(PREDICTED.bare.drift, PREDICTED.bare.u1)


@pytest.mark.parametrize(("layer", "status"), [("rocking", PointStatus.STEADY), ("resting", PointStatus.RESTING)])
@pytest.mark.parametrize("error", [-0.015, 0.0, 0.015])
def test_each_layer_is_recognised(layer: str, status: PointStatus, error: float) -> None:
    expected = PREDICTED.layers[layer]
    peaks = expected.orbit.peaks
    point = judge(_settled(peaks.drift * (1 + error), peaks.u1), BARE, OMEGA, SPECIMEN, SensorAccuracy(), 2)
    assert (point.status, point.layer) == (status, layer)
    assert point.alpha_2_predicted == pytest.approx(expected.alpha_2)
    assert point.agrees is True


def test_a_difference_beyond_two_per_cent_and_the_uncertainty_is_flagged() -> None:
    peaks = PREDICTED.layers["rocking"].orbit.peaks
    exact = SensorAccuracy(laser_slope=0.0, laser_mismatch=0.0, laser_resolution=0.0)
    point = judge(_settled(1.025 * peaks.drift, peaks.u1), BARE, OMEGA, SPECIMEN, exact, 1)
    assert point.agrees is False
    assert "differs" in point.reason
    vague = judge(_settled(1.025 * peaks.drift, peaks.u1), BARE, OMEGA, SPECIMEN, SensorAccuracy(laser_slope=0.02), 1)
    assert vague.agrees is True


@pytest.mark.parametrize(("repeats", "words"), [(0, "does not repeat"), (3, "repeats every 3 cycles")])
def test_what_is_not_steady_is_modulated_and_says_how(repeats: int, words: str) -> None:
    peaks = PREDICTED.layers["rocking"].orbit.peaks
    point = judge(
        _settled(peaks.drift, peaks.u1, Steadiness(False, 0.3, 0.1, repeats)),
        BARE,
        OMEGA,
        SPECIMEN,
        SensorAccuracy(),
        1,
    )
    assert point.status is PointStatus.MODULATED
    assert words in point.reason
    assert point.agrees is None


def test_a_bare_frame_that_was_not_steady_is_no_reference() -> None:
    peaks = PREDICTED.layers["rocking"].orbit.peaks
    wandering = _settled(PREDICTED.bare.drift, PREDICTED.bare.u1, Steadiness(False, 0.1, 0.1, 0))
    point = judge(_settled(peaks.drift, peaks.u1), wandering, OMEGA, SPECIMEN, SensorAccuracy(), 1)
    assert point.agrees is None
    assert "bare frame was not steady" in point.reason


def test_a_steady_motion_on_an_unstable_orbit_says_that_it_will_not_last() -> None:
    specimen = Specimen().coupled(0.64)
    predicted = predict_gain(specimen, 12.5, AMPLITUDE)
    assert predicted.rocking is not None
    peaks = predicted.rocking.orbit.peaks
    bare = _settled(predicted.bare.drift, predicted.bare.u1)
    point = judge(_settled(peaks.drift, peaks.u1), bare, 12.5, specimen, SensorAccuracy(), 1)
    assert point.predicted_stable is False
    assert "the predicted orbit is unstable" in point.reason


def test_a_table_that_is_off_is_told() -> None:
    peaks = PREDICTED.layers["rocking"].orbit.peaks
    good = _settled(peaks.drift, peaks.u1)
    assert judge(good, BARE, OMEGA, SPECIMEN, SensorAccuracy(), 1).reason == ""
    off = replace(good, amplitude_error=-0.004, phase_error=0.002, peak=replace(good.peak, harmonics=0.013))
    point = judge(off, BARE, OMEGA, SPECIMEN, SensorAccuracy(), 1)
    assert "the table's amplitude is -0.40 % off" in point.reason
    assert "the table's harmonics are 1.3 % of its fundamental" in point.reason
    assert (point.amplitude_error, point.phase_error_rad, point.table_harmonics) == (-0.004, 0.002, 0.013)
    assert point.table_updates == 3


def test_a_resting_block_says_that_the_stable_rocking_motion_was_not_reached() -> None:
    peaks = PREDICTED.layers["resting"].orbit.peaks
    point = judge(_settled(peaks.drift, peaks.u1), BARE, OMEGA, SPECIMEN, SensorAccuracy(), 6)
    assert "no start reached the stable rocking motion" in point.reason
