"""The steps of the harmonic campaign on a scripted bench: outcomes in, steps and points out."""

from dataclasses import replace

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.engine.steps import (
    Arm,
    Calibrate,
    Done,
    Dwell,
    Measured,
    OperatorAction,
    Publish,
    RampOut,
    Sweep,
)
from bench.events import Progress
from bench.live_values import Estimate
from drivers.rig import OperatorTask
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import PointStatus
from sim.gain import predict_gain
from sim.specimen import Specimen
from tests.protocols.harmonic.scripted import AMPLITUDE, BETA, OMEGA, PARAMETERS, Script, cycle

pytestmark = pytest.mark.usefixtures("shared_results")


@pytest.fixture(scope="module")
def peaks() -> tuple[float, float, float]:
    """Predicted peaks: bare drift, coupled drift, coupled u1."""
    found = predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE)
    assert found.rocking is not None
    return found.bare.drift, found.rocking.orbit.peaks.drift, found.rocking.orbit.peaks.u1


def test_a_steady_rocking_motion_is_the_point_at_the_first_start(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: cycle(k, drift, u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.STEADY
    assert point.alpha_2 == pytest.approx(drift / bare)
    assert point.agrees is True
    assert point.starts_tried == 1
    assert script.works() == [OperatorTask.REMOVE_BLOCK, OperatorTask.MOUNT_SPRING]


def test_points_are_reported_in_the_order_in_which_they_were_asked_for(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    parameters = PARAMETERS.model_copy(update={"omega": (17.0, OMEGA), "starts": 1})
    campaign = HarmonicCampaign(parameters, BenchConfiguration())
    points = Script(lambda _, k: cycle(k, drift, u1), bare, campaign).run()
    assert [(point.omega_rad_s, point.beta) for point in points] == [(17.0, BETA), (OMEGA, BETA)]


def test_a_fall_is_ended_fast_the_block_stood_up_and_the_next_start_tried(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda start, k: None if start == 1 else cycle(k, drift, u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.STEADY
    assert point.starts_tried == 2
    assert script.works()[2:] == [OperatorTask.STAND_BLOCK_UP]
    assert RampOut(fast=True) in script.steps


def test_a_point_that_no_start_reaches_is_reported_as_overturned(peaks: tuple[float, float, float]) -> None:
    script = Script(lambda *_: None, peaks[0])
    (point,) = script.run()
    assert point.status is PointStatus.OVERTURNED
    assert point.starts_tried == 3
    assert point.alpha_2 is None
    assert point.alpha_2_predicted == pytest.approx(peaks[1] / peaks[0])
    assert "fell after every start (3 tried)" in point.reason
    assert script.works()[2:] == [OperatorTask.STAND_BLOCK_UP] * 3


def test_a_motion_that_never_settles_is_modulated_after_all_starts(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: cycle(k, drift * (1.0 + 0.3 * np.sin(2.4 * k)), u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.MODULATED
    assert point.starts_tried == 3
    assert point.agrees is None
    assert point.alpha_2 == pytest.approx(1.3 * drift / bare, rel=0.02)


def test_a_sensor_that_loses_the_peaks_is_an_error_that_says_so(peaks: tuple[float, float, float]) -> None:
    script = Script(lambda *_: None, peaks[0])
    script._answer = lambda step: Measured(()) if isinstance(step, Dwell) else Done()
    with pytest.raises(Unmeasurable, match="missing samples"):
        script.run()


def test_a_table_that_does_not_answer_is_an_error_before_the_drive_is_raised(peaks: tuple[float, float, float]) -> None:
    silent = replace(cycle(0, 0.0), fundamental=np.zeros(7, dtype=complex), noise=np.full(7, 0.01))
    script = Script(lambda *_: None, peaks[0])
    script._answer = lambda step: Measured((silent,) * step.cycles) if isinstance(step, Dwell) else Done()
    with pytest.raises(Unmeasurable, match="does not respond to the drive"):
        script.run()
    followed = [segment.amplitude for step in script.steps if isinstance(step, Sweep) for segment in step.segments]
    assert followed == [PROBE]


def test_a_drive_is_never_followed_before_it_was_armed_and_calibrated(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: cycle(k, drift, u1), bare)
    script.run()
    armed = calibrated = False
    for step in script.steps:
        if isinstance(step, Arm):
            armed, calibrated = True, False
        elif isinstance(step, Calibrate):
            calibrated = True
        elif isinstance(step, RampOut):
            armed = False
        elif isinstance(step, Sweep | Dwell):
            assert armed
            assert calibrated
        elif isinstance(step, OperatorAction):
            assert not armed


@pytest.mark.parametrize("falls", [0, 1])
def test_progress_goes_to_the_end_and_never_back(peaks: tuple[float, float, float], falls: int) -> None:
    bare, drift, u1 = peaks
    # a block that falls late takes the progress of its start with it
    script = Script(lambda start, k: None if start <= falls and k >= 20 else cycle(k, drift, u1), bare)
    script.run()
    assert script.start == 1 + falls
    fractions = [
        step.event.fraction for step in script.steps if isinstance(step, Publish) and isinstance(step.event, Progress)
    ]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)
    estimates = [step.event for step in script.steps if isinstance(step, Publish) and isinstance(step.event, Estimate)]
    assert any(estimate.beta == BETA and np.isfinite(estimate.alpha_2) for estimate in estimates)
