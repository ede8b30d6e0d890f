"""Numbers of the long computations of a point: unlike times, they are the same on every machine."""

from unittest.mock import patch

import numpy as np
import pytest

from bench.analysis import sensor_uncertainty
from bench.engine.steps import Publish
from bench.live_values import Estimate
from protocols.harmonic import judgement, plan
from protocols.harmonic.protocol import PointStatus
from sim import cycle_map, table_orbit
from sim.gain import GainPrediction, predict_gain
from sim.specimen import Specimen
from tests.protocols.harmonic.scripted import AMPLITUDE, BETA, OMEGA, Script, cycle


@pytest.fixture(scope="module")
def predicted() -> GainPrediction:
    return predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE)


def _script(predicted: GainPrediction, modulation: float) -> Script:
    assert predicted.rocking is not None
    peaks = predicted.rocking.orbit.peaks
    return Script(
        lambda _, k: cycle(k, peaks.drift * (1.0 + modulation * np.sin(2.4 * k)), peaks.u1), predicted.bare.drift
    )


def test_a_steady_point_evaluates_the_linearity_for_its_first_check_and_for_its_result(
    predicted: GainPrediction,
) -> None:
    script = _script(predicted, 0.0)
    with (
        patch.object(sensor_uncertainty, "linearity_errors", wraps=sensor_uncertainty.linearity_errors) as evaluated,
        patch.object(plan, "predict_gain", wraps=predict_gain) as followed,
    ):
        (point,) = script.run()
    assert point.status is PointStatus.STEADY
    checks = [each for each in script.steps if isinstance(each, Publish) and isinstance(each.event, Estimate)]
    assert len(checks) > 4
    assert evaluated.call_count == 4, "two lasers, twice"
    assert followed.call_count == 1, "the branch at the nominal amplitude"


def test_a_point_with_three_unsteady_starts_follows_its_branch_once_and_designs_one_stabiliser(
    predicted: GainPrediction,
) -> None:
    script = _script(predicted, 0.3)
    find = table_orbit.table_orbit
    with (
        patch.object(plan, "predict_gain", wraps=predict_gain) as followed,
        patch.object(cycle_map, "table_orbit", wraps=find) as designed,
        patch.object(judgement, "table_orbit", wraps=find) as judged,
    ):
        (point,) = script.run()
    assert point.starts_tried == 3
    assert followed.call_count == 1
    assert designed.call_count == 1
    assert judged.call_count <= 3, "one for the amplitude reached by each start"
