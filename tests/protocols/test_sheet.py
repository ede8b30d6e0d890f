"""The lab sheet without a bench: scripted outcomes in, steps and points out."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bench.analysis.cycles import Cycle
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, U1
from bench.config.model import BenchConfiguration
from bench.engine.steps import (
    Arm,
    Calibrate,
    Done,
    Dwell,
    Fallen,
    Follow,
    Handle,
    Measured,
    Outcome,
    RampOut,
    Say,
    Step,
)
from bench.events import Estimate, PointFinished, Progress
from bench.protocol import Result
from drivers.rig import Handwork
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from sim.gain import predict_gain
from sim.specimen import Specimen
from tests.made_cycles import pure_cycle

OMEGA, BETA = 16.0, 0.4
PARAMETERS = HarmonicParameters(omega=(OMEGA,), beta=(BETA,), starts=3, settle_limit=30.0)
AMPLITUDE = PARAMETERS.amplitude_factor * Specimen().uplift_acceleration


def _cycle(index: int, drift: float, u1: float = 0.001, turn: float = 0.0) -> Cycle:
    fundamental = np.zeros(7, dtype=complex)
    fundamental[ACCELERATION], fundamental[6] = AMPLITUDE, 1.0
    fundamental[U1], fundamental[DRIFT], fundamental[LASER_1] = u1, drift * np.exp(1j * turn), u1
    fundamental[LASER_2] = fundamental[U1] + fundamental[DRIFT]
    return pure_cycle(index, fundamental, samples=700)


class Script:
    """Answers the steps of a plan and keeps them."""

    def __init__(
        self,
        coupled: Callable[[int, int], Cycle | None],
        bare: float,
        prepared: HarmonicCampaign | None = None,
    ) -> None:
        self._prepared = prepared or HarmonicCampaign(PARAMETERS, BenchConfiguration())
        self._coupled, self._bare = coupled, bare
        self.steps: list[Step] = []
        self.start = 0
        self.cycles = 0
        self.testing = False
        self.mounted = False

    def run(self) -> list[HarmonicPoint]:
        plan = self._prepared.plan()
        points: list[HarmonicPoint] = []
        step = next(plan)
        try:
            while True:
                self.steps.append(step)
                if isinstance(step, Say) and isinstance(step.event, PointFinished):
                    assert isinstance(step.event.point, HarmonicPoint)
                    points.append(step.event.point)
                step = plan.send(self._answer(step))
        except StopIteration as end:
            result = end.value
        assert isinstance(result, Result)
        assert list(result.points) == points
        return points

    def _answer(self, step: Step) -> Outcome:
        match step:
            case Handle(work=Handwork.MOUNT_SPRING):
                self.mounted = True
            case Arm():
                self.cycles = 0
                self.testing = False
            case Follow(legs=legs) if self.mounted and len(legs) > 1:
                self.testing = True
                self.start += 1
            case Dwell(cycles=n) if self.testing:
                made = [self._coupled(self.start, self.cycles + k) for k in range(n)]
                self.cycles += n
                found = [cycle for cycle in made if cycle is not None]
                return Measured(tuple(found)) if len(found) == n else Fallen()
            case Dwell(cycles=n):
                return Measured(tuple(_cycle(k, self._bare) for k in range(n)))
            case _:
                pass
        return Done()

    def works(self) -> list[Handwork]:
        return [step.work for step in self.steps if isinstance(step, Handle)]


@pytest.fixture(scope="module")
def peaks() -> tuple[float, float, float]:
    """Predicted peaks: bare drift, coupled drift, coupled u1."""
    found = predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE)
    assert found.rocking is not None
    return found.bare.drift, found.rocking.orbit.peaks.drift, found.rocking.orbit.peaks.u1


def test_a_steady_rocking_motion_is_the_point_at_the_first_start(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: _cycle(k, drift, u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.STEADY
    assert point.alpha_2 == pytest.approx(drift / bare)
    assert point.agrees is True
    assert point.starts_tried == 1
    assert script.works() == [Handwork.REMOVE_BLOCK, Handwork.MOUNT_SPRING]


def test_a_fall_is_ended_fast_the_block_stood_up_and_the_next_start_tried(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda start, k: None if start == 1 else _cycle(k, drift, u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.STEADY
    assert point.starts_tried == 2
    assert script.works()[2:] == [Handwork.STAND_BLOCK_UP]
    assert RampOut(fast=True) in script.steps


def test_a_point_that_no_start_reaches_is_reported_as_overturned(peaks: tuple[float, float, float]) -> None:
    script = Script(lambda *_: None, peaks[0])
    (point,) = script.run()
    assert point.status is PointStatus.OVERTURNED
    assert point.starts_tried == 3
    assert point.alpha_2 is None
    assert point.alpha_2_predicted == pytest.approx(peaks[1] / peaks[0])
    assert "fell in each of 3 starts" in point.reason
    assert script.works()[2:] == [Handwork.STAND_BLOCK_UP] * 3


def test_a_motion_that_never_settles_is_modulated_after_all_starts(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: _cycle(k, drift * (1.0 + 0.3 * np.sin(2.4 * k)), u1), bare)
    (point,) = script.run()
    assert point.status is PointStatus.MODULATED
    assert point.starts_tried == 3
    assert point.agrees is None
    assert point.alpha_2 == pytest.approx(1.3 * drift / bare, rel=0.02)


def test_a_sensor_that_loses_the_peaks_is_an_error_that_says_so(peaks: tuple[float, float, float]) -> None:
    script = Script(lambda *_: None, peaks[0])
    script._answer = lambda step: Measured(()) if isinstance(step, Dwell) else Done()
    with pytest.raises(Unmeasurable, match="lack samples"):
        script.run()


def test_a_table_that_does_not_answer_is_an_error_before_the_drive_is_raised(peaks: tuple[float, float, float]) -> None:
    silent = replace(_cycle(0, 0.0), fundamental=np.zeros(7, dtype=complex), noise=np.full(7, 0.01))
    script = Script(lambda *_: None, peaks[0])
    script._answer = lambda step: Measured((silent,) * step.cycles) if isinstance(step, Dwell) else Done()
    with pytest.raises(Unmeasurable, match="does not answer the drive"):
        script.run()
    followed = [leg.amplitude for step in script.steps if isinstance(step, Follow) for leg in step.legs]
    assert followed == [PROBE]


def test_a_drive_is_never_followed_before_it_was_armed_and_calibrated(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: _cycle(k, drift, u1), bare)
    script.run()
    armed = calibrated = False
    for step in script.steps:
        if isinstance(step, Arm):
            armed, calibrated = True, False
        elif isinstance(step, Calibrate):
            calibrated = True
        elif isinstance(step, RampOut):
            armed = False
        elif isinstance(step, Follow | Dwell):
            assert armed
            assert calibrated
        elif isinstance(step, Handle):
            assert not armed


def test_progress_goes_to_the_end_and_never_back(peaks: tuple[float, float, float]) -> None:
    bare, drift, u1 = peaks
    script = Script(lambda _, k: _cycle(k, drift, u1), bare)
    script.run()
    fractions = [
        step.event.fraction for step in script.steps if isinstance(step, Say) and isinstance(step.event, Progress)
    ]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)
    estimates = [step.event for step in script.steps if isinstance(step, Say) and isinstance(step.event, Estimate)]
    assert any(estimate.beta == BETA and np.isfinite(estimate.alpha_2) for estimate in estimates)
