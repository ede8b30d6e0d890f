"""How springs, frame and masses hang together: against errors drawn of weighing, timebase and decays (Monte Carlo)."""

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.free_decay.decay import Combined
from protocols.common.decays.findings import frame_findings
from protocols.common.decays.frame import FrameResult
from protocols.coupling_stiffness.springs import (
    identified_reference,
    measured_reference,
    replaces,
    spring_findings,
    spring_result,
)
from sim.identified import Identified

Array = NDArray[np.float64]

N = 200_000
MASSES = np.array([1.0624, 1.0721])
WEIGHED = np.array([[5e-4, 0.0], [3e-4, 4e-4]]) @ np.array([[5e-4, 3e-4], [0.0, 4e-4]])
BARE = np.array([213.44, 56.45, 0.012, 0.025, 0.5, 0.4, 5.9, 16.3])
SPREAD = np.array([0.03, 0.01, 1e-5, 3e-5, 0.01, 0.01, 1e-5, 1e-4])
NAMES = ("k1", "k2", "m1", "m2", "k_c:0.25", "k_c:0.97")


def shift_of(values: Array) -> Array:
    shares = np.array([[0.8, 0.2], [-0.1, 1.1], *[[0.0, 0.0]] * 2, [0.8, 0.2], [0.0, 1.0], *[[0.0, 0.0]] * 2])
    return shares * values[:, None] / MASSES


def frame(values: Array, timebase: float = 0.0, spread: Array = SPREAD) -> FrameResult:
    late = timebase * np.array([2.0, 2.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]) * values
    own = np.diag(spread**2)
    own[0, 1] = own[1, 0] = -0.5 * spread[0] * spread[1]
    shift = shift_of(values)
    common = shift @ WEIGHED @ shift.T + np.outer(late, late)
    none = np.zeros(8)
    combined = Combined(values, own, common, none, np.ones((1, 8)), none)
    slopes = Combined(none[:2], np.eye(2), np.zeros((2, 2)), none[:2], np.ones((1, 2)), none[:2])
    return FrameResult((), combined, slopes, (MASSES[0], MASSES[1]), WEIGHED, shift, late, {})


def with_spring(share: float) -> Array:
    return np.array([BARE[0] * (1.0 + share), *BARE[1:]])


def drawn(seed: int, values: Array, weighing: Array, clock: Array, timebase: float) -> Array:
    """Errors of k1 and k2 as decays of one frame find them, shape (2, N)."""
    random = np.random.default_rng(seed)
    own = np.diag(SPREAD[:2] ** 2)
    own[0, 1] = own[1, 0] = -0.5 * SPREAD[0] * SPREAD[1]
    errors = random.multivariate_normal([0.0, 0.0], own, N).T
    return errors + shift_of(values)[:2] @ weighing + np.outer(2.0 * timebase * values[:2], clock)


def expected(timebase: float) -> Array:
    random = np.random.default_rng(8)
    weighing, clock = random.multivariate_normal([0.0, 0.0], WEIGHED, N).T, random.standard_normal(N)
    bare, soft, stiff = (
        drawn(seed, values, weighing, clock, timebase)
        for seed, values in enumerate((BARE, with_spring(0.25), with_spring(0.97)))
    )
    return np.array([*bare, *weighing, soft[0] - bare[0], stiff[0] - bare[0]])


def springs_after(known: Identified, label: float) -> Identified:
    reference = identified_reference(known)
    assert reference is not None
    spring = spring_result(label, frame(with_spring(label)), reference)
    return known.extended(*spring_findings(None, [spring], known))


@pytest.mark.parametrize("timebase", [0.0, 1e-4])
def test_all_in_one_run_hangs_together_as_the_errors_do(timebase: float) -> None:
    bare = frame(BARE, timebase)
    springs = [
        spring_result(each, frame(with_spring(each), timebase), measured_reference(bare)) for each in (0.25, 0.97)
    ]
    found = Identified().extended(*spring_findings(bare, springs, Identified()))
    errors = expected(timebase)
    np.testing.assert_allclose(found.correlation(NAMES), np.corrcoef(errors), atol=0.012)
    sizes = [springs[0].uncertainty, springs[1].uncertainty]
    np.testing.assert_allclose(sizes, errors[4:].std(axis=1), rtol=0.01)


def test_springs_found_one_after_the_other_against_a_known_frame_do_so_as_well() -> None:
    known = Identified().extended(*frame_findings(frame(BARE), Identified()))
    found = springs_after(springs_after(known, 0.25), 0.97)
    np.testing.assert_allclose(found.correlation(NAMES), np.corrcoef(expected(0.0)), atol=0.012)


def test_a_frame_measured_again_keeps_the_weighing_and_what_springs_share_with_it() -> None:
    known = springs_after(Identified().extended(*frame_findings(frame(BARE), Identified())), 0.25)
    again = known.extended(*frame_findings(frame(BARE), known))
    assert again.finding("m1") == known.finding("m1")
    errors = expected(0.0)
    weighing = errors[2:4]
    fresh = drawn(77, BARE, weighing, np.zeros(N), 0.0)
    wanted = np.corrcoef([*fresh, *weighing, errors[4]])
    np.testing.assert_allclose(again.correlation(NAMES[:5]), wanted, atol=0.012)


@pytest.mark.parametrize(("spread", "moved", "kept"), [(2.0, 0.0, True), (0.5, 0.0, False), (2.0, 2.0, False)])
def test_an_earlier_frame_stays_unless_it_changed_or_is_known_better_now(
    spread: float, moved: float, kept: bool
) -> None:
    known = Identified().extended(*frame_findings(frame(BARE), Identified()))
    bare = frame(BARE + np.array([moved, *[0.0] * 7]), spread=spread * SPREAD)
    assert replaces(bare, known) is not kept
    spring = spring_result(0.25, frame(with_spring(0.25)), measured_reference(bare))
    found = known.extended(*spring_findings(bare, [spring], known))
    assert (found.finding("k1") == known.finding("k1")) is kept
    source = found.finding("k1")
    assert source is not None
    assert source.source == "free vibration of the bare frame"
