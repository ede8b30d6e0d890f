"""Where starts lead, against statistics known from other programs and against the motions themselves."""

from math import tau

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.maps import GainMap, gain_map
from sim.outcomes import Outcome, OutcomeMap, outcome_map, reached, switched_on
from sim.rocking import Mode, simulate
from sim.specimen import Specimen
from tests.sim.runs import A_S

PERIOD_TWO = Specimen(beta=0.3), 15.81818
"""Here the motion from rest repeats after two periods of the drive, beside a stable orbit of one."""


@pytest.fixture(scope="module")
def coarse() -> GainMap:
    return gain_map(Specimen(), np.linspace(0.1, 1.2, 20), np.linspace(12.0, 21.0, 20), A_S)


@pytest.fixture(scope="module")
def outcomes(coarse: GainMap) -> OutcomeMap:
    return outcome_map(coarse)


def test_a_quarter_of_the_starts_from_rest_overturn(coarse: GainMap, outcomes: OutcomeMap) -> None:
    # known from a grid of 10 000: 2 553 overturn within 120 s, 2 182 of them where the orbit is stable; of 400 cells
    # drawn from those, one standard deviation is 2.2 %
    early = (outcomes.outcome == "toppled") & (outcomes.time <= 120.0)
    assert early.mean() == pytest.approx(0.2553, abs=0.066)
    assert (early & coarse.rocking.stable).mean() == pytest.approx(0.2182, abs=0.062)
    # within seconds
    assert np.median(outcomes.time[early]) < 10.0
    assert outcomes.count(Outcome.TOPPLED) >= early.sum()
    assert outcomes.count(Outcome.FAILED) == 0


def test_most_starts_land_on_the_resting_motion_where_it_exists(coarse: GainMap, outcomes: OutcomeMap) -> None:
    # known: 1 214 of 1 441
    resting = outcomes.outcome == "resting"
    assert not (resting & ~coarse.resting.exists).any()
    assert resting.sum() / coarse.resting.exists.sum() == pytest.approx(1214 / 1441, abs=0.16)
    assert outcomes.drift[resting] == pytest.approx(coarse.resting.peaks[resting][:, 1], rel=0.02)


def test_an_unstable_orbit_is_never_reached(coarse: GainMap, outcomes: OutcomeMap) -> None:
    rocking = outcomes.outcome == "rocking"
    assert not (rocking & ~coarse.rocking.stable).any()
    # known: 5 065 of the 6 726 that survive on a stable orbit's cell reach it within 120 s
    assert rocking.mean() == pytest.approx(0.5065, abs=0.08)
    assert outcomes.drift[rocking] == pytest.approx(coarse.rocking.peaks[rocking][:, 1], rel=0.02)
    # what goes on beside an unstable orbit is large
    other = (outcomes.outcome == "other") & ~coarse.rocking.stable
    assert np.median(outcomes.drift[other] / coarse.rocking.peaks[other][:, 1]) > 2.0


def test_toppled_has_a_time_and_a_side(coarse: GainMap, outcomes: OutcomeMap) -> None:
    toppled = outcomes.outcome == "toppled"
    assert set(outcomes.side[toppled]) == {"A", "B"}
    assert set(outcomes.side[~toppled]) == {""}
    assert np.isnan(outcomes.drift[toppled]).all()
    i, j = np.argwhere(toppled)[0]
    omega = float(coarse.omegas[j])
    motion = simulate(Specimen(beta=float(coarse.betas[i])), switched_on(omega, A_S))
    assert motion.overturned == outcomes.side[i, j]
    assert motion.end_time == outcomes.time[i, j]
    assert abs(motion.end.theta) == pytest.approx(np.pi / 2.0)


def test_another_attractor_is_called_so() -> None:
    specimen, omega = PERIOD_TWO
    result = reached(specimen, omega, A_S)
    assert result.outcome is Outcome.OTHER
    assert result.peaks is not None
    assert result.time > 120.0
    # it is one: after two thousand periods it repeats every two, not every one
    period = tau / omega
    settled = simulate(specimen, SineProgram([Sweep.dwell(2000.0 * period, A_S, omega)])).end
    again = SineProgram([Sweep.dwell(2.5 * period, A_S, omega)])
    samples = simulate(specimen, again, state=settled, sample_times=[0.0, period, 2.0 * period]).samples
    assert samples is not None
    assert samples[2] == pytest.approx(samples[0], abs=1e-7)
    assert abs(samples[1, 4] - samples[0, 4]) > 0.01


def soft(omega: float, amplitude: float) -> SineProgram:
    """A start that works more often: ramp up at 22 rad/s, chirp down, dwell."""
    down = Sweep((22.0 - omega) / 0.5, (amplitude, amplitude), (22.0, omega))
    return SineProgram([Sweep(10.0, (0.0, amplitude), (22.0, 22.0)), down, Sweep.dwell(60.0, amplitude, omega)], 0.7)


def test_a_soft_start_topples_less_often(coarse: GainMap, outcomes: OutcomeMap) -> None:
    gently = outcome_map(coarse, soft)
    assert gently.count(Outcome.TOPPLED) < 0.7 * outcomes.count(Outcome.TOPPLED)
    # a program of another length ends at another phase: what was decided later than its end needed the right one
    later = (gently.time > 10.0 + (22.0 - coarse.omegas) / 0.5 + 60.0 + 1e-6) & (gently.outcome == "rocking")
    assert later.any()


def test_a_weak_drive_never_lifts_the_block() -> None:
    result = reached(Specimen(beta=0.4), 10.0, 0.3 * A_S)
    assert (result.outcome, result.side) == (Outcome.RESTING, None)
    assert result.time >= 120.0
    assert result.peaks is not None
    assert result.peaks.theta == 0.0
    assert simulate(Specimen(beta=0.4), switched_on(10.0, 0.3 * A_S)).end.mode is Mode.REST


def test_a_start_must_end_where_the_point_is() -> None:
    for wrong in (soft(15.0, A_S), SineProgram([Sweep.dwell(1.0, A_S, 16.0)])):
        with pytest.raises(InvalidInput, match="start"):
            reached(Specimen(beta=0.4), 16.0, A_S, lambda _omega, _amplitude, wrong=wrong: wrong)
    with pytest.raises(InvalidInput, match="specimen"):
        reached(Specimen(), 16.0, A_S)
