"""Planned starts: robust first, honest about what works, and ending where the test is to be."""

import pytest

from bench.control.legs import program
from bench.control.starts import CATCH_ANGLE, plan_starts
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.rocking import simulate
from sim.specimen import Specimen

AMPLITUDE = 1.01 * 9.81 / 8.0


@pytest.mark.parametrize(("omega", "beta"), [(12.5, 0.25), (17.5, 0.64), (20.0, 0.97)])
def test_the_first_start_leads_to_the_orbit(omega: float, beta: float) -> None:
    specimen = Specimen().coupled(beta)
    layer = predict_gain(specimen, omega, AMPLITUDE).rocking
    assert layer is not None
    start, *others = plan_starts(specimen, omega, AMPLITUDE, layer.orbit, 4)
    assert len(others) == 3
    assert all(start.chance >= other.chance for other in others)
    assert start.legs[-1].amplitude == AMPLITUDE
    assert start.legs[-1].omega == omega
    motion = simulate(
        specimen,
        SineProgram([*program(start.legs).sweeps, Sweep.dwell(150.0, AMPLITUDE, omega)]),
        peaks_from=start.duration + 140.0,
        overturning_angle=CATCH_ANGLE,
    )
    assert motion.peaks.drift == pytest.approx(layer.orbit.peaks.drift, rel=0.02)
    assert motion.peaks.theta == pytest.approx(layer.orbit.peaks.theta, rel=0.02)


def test_where_two_layers_exist_the_block_is_lifted_off_its_rest() -> None:
    """At beta = 0.25 and 20 rad/s a soft start without overshoot leaves the block at rest."""
    specimen = Specimen().coupled(0.25)
    found = predict_gain(specimen, 20.0, AMPLITUDE)
    assert found.rocking is not None
    assert found.resting is not None
    start = plan_starts(specimen, 20.0, AMPLITUDE, found.rocking.orbit, 1)[0]
    assert start.chance == 1.0
    assert max(leg.amplitude for leg in start.legs) > AMPLITUDE


def test_where_the_orbit_is_unstable_a_start_only_has_to_keep_the_block_standing() -> None:
    specimen = Specimen().coupled(0.97)
    layer = predict_gain(specimen, 15.0, AMPLITUDE).rocking
    assert layer is not None
    assert not layer.stable
    assert plan_starts(specimen, 15.0, AMPLITUDE, layer.orbit, 2)[0].chance > 0.5
