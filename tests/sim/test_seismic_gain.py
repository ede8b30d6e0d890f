"""Gain curves under records, against linear theory and the motions themselves."""

import numpy as np
import pytest
from scipy.signal import lsim, lti

from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.gain import seismic_curve
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.sim.oracle import reference_motion


def noise(peak: float, seed: int = 5, seconds: float = 20.0) -> SampledRecord:
    """Band-limited noise with a smooth beginning and end."""
    t = np.arange(0.0, seconds, 0.01)
    rng = np.random.default_rng(seed)
    waves = [np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in np.linspace(0.5, 6.0, 30)]
    shape = np.sum(waves, axis=0) * np.sin(np.pi * t / seconds) ** 2
    return SampledRecord(peak * shape / np.abs(shape).max(), 0.01)


def linear_drift(specimen: Specimen, record: SampledRecord) -> float:
    """Greatest |u2 - u1| [m] of the linear frame, its spring grounded, under straight lines between samples: exact."""
    frame, (c1, c2) = specimen.frame, specimen.frame.dashpots
    stiffness = np.array([[frame.k1 + frame.k2 + specimen.k_c, -frame.k2], [-frame.k2, frame.k2]])
    damping = np.array([[c1 + c2, -c2], [-c2, c2]])
    a = np.zeros((4, 4))
    a[:2, 2:], a[2:, :2], a[2:, 2:] = np.eye(2), -stiffness / frame.m1, -damping / frame.m1
    system = lti(a, np.array([[0.0], [0.0], [-1.0], [-1.0]]), np.array([[-1.0, 1.0, 0.0, 0.0]]), np.zeros((1, 1)))
    times = np.linspace(0.0, record.duration, 20 * (record.acceleration.size - 1) + 1)
    coarse = np.arange(record.acceleration.size) * record.dt
    _, drift, _ = lsim(system, np.interp(times, coarse, record.acceleration), times)
    return float(np.abs(drift).max())


def test_a_block_that_never_lifts_is_a_grounded_spring() -> None:
    record, specimen = noise(0.5), Specimen(beta=0.6)
    (gain,) = seismic_curve(specimen, record, [0.6])
    assert gain.motion.peaks.theta == 0.0
    # the peak of samples at half a millisecond
    expected = linear_drift(specimen, record) / linear_drift(specimen.bare(), record)
    assert gain.alpha_2 == pytest.approx(expected, rel=1e-4)


def test_a_rocking_block_is_the_reference_motion() -> None:
    record, specimen = noise(1.6, seconds=4.0), Specimen(beta=0.5)
    (gain,) = seismic_curve(specimen, record, [0.5])
    assert gain.motion.impacts > 3
    times = (np.arange(record.acceleration.size) * record.dt).tolist()
    end, impacts = reference_motion(
        specimen, lambda t: float(np.interp(t, times, record.acceleration)), times, np.zeros(6), 0
    )
    assert len(impacts) >= 3
    assert gain.motion.end.as_array() == pytest.approx(end, abs=1e-8)


def test_a_toppled_run_is_marked() -> None:
    record = noise(6.0)
    curve = seismic_curve(Specimen(), record, np.linspace(0.1, 1.0, 8))
    assert [gain.beta for gain in curve] == pytest.approx(np.linspace(0.1, 1.0, 8))
    toppled = [gain for gain in curve if gain.motion.overturned]
    assert toppled
    for gain in toppled:
        assert gain.alpha_1 is None
        assert gain.alpha_2 is None
        assert 0.0 < gain.motion.end_time < record.duration
    for gain in curve:
        alone = simulate(Specimen(beta=gain.beta), record)
        assert gain.motion.overturned == alone.overturned
        if gain.alpha_2 is not None:
            assert gain.alpha_2 == alone.peaks.drift / simulate(Specimen(), record).peaks.drift


def test_bad_input_is_refused() -> None:
    with pytest.raises(InvalidInput, match="record"):
        seismic_curve(Specimen(), SampledRecord(np.zeros(10), 0.01), [0.4])
    with pytest.raises(ValueError, match="beta"):
        seismic_curve(Specimen(), noise(1.0), [-0.4])


def test_the_bare_frame_goes_the_exact_linear_way_however_strong_the_record() -> None:
    """Times 128, every rounding is the same: no event, no step of the rocking integrator, one step for each sample."""
    weak = noise(1.0)
    strong = SampledRecord(128.0 * weak.acceleration, weak.dt)
    one, other = simulate(Specimen(), weak), simulate(Specimen(), strong)
    assert one.steps == other.steps == weak.acceleration.size - 1
    assert one.impacts == other.impacts == 0
    assert other.peaks.theta == 0.0
    assert np.array_equal(other.end.as_array(), 128.0 * one.end.as_array())
    assert (other.peaks.u1, other.peaks.drift) == (128.0 * one.peaks.u1, 128.0 * one.peaks.drift)
    # a block lifts under the same record, and steps twice at its events
    assert simulate(Specimen(beta=0.0), strong).peaks.theta > 0.0
