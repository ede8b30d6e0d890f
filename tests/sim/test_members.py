"""Members side by side in lanes have the bits of single runs, whatever their neighbours do."""

from typing import Any

import numpy as np
import pytest

from sim.ensemble import simulate_many
from sim.excitation import Excitation, SampledRecord, SineProgram, Sweep
from sim.kernel.lanes import fma, get, get2, put, put2, some, zero
from sim.kernel.taylor import WORK_ROWS
from sim.rocking import Motion, State, Status, simulate
from sim.specimen import Specimen
from tests.sim import recurrences

RNG = np.random.default_rng(7)
T = np.arange(0.0, 8.0, 0.01)


def start(omega: float) -> SineProgram:
    """A ramp, a chirp and a dwell, as a campaign starts a steady motion."""
    sweeps = [
        Sweep(4.0, (0.0, 1.4), (28.0, 28.0)),
        Sweep(3.0, (1.4, 1.4), (28.0, omega)),
        Sweep.dwell(3.0, 1.24, omega),
    ]
    return SineProgram(sweeps)


def record(scale: float) -> SampledRecord:
    return SampledRecord(scale * np.sin(9.0 * T) * np.sin(np.pi * T / 8.0) + 0.1 * RNG.normal(size=T.size), 0.01)


def same(many: Motion, alone: Motion) -> bool:
    return (many.status, many.end_time, many.end, many.impacts, many.steps, repr(many.peaks)) == (
        alone.status,
        alone.end_time,
        alone.end,
        alone.impacts,
        alone.steps,
        repr(alone.peaks),
    )


@pytest.mark.parametrize("peaks_from", [0.0, 5.0, None])
def test_every_member_has_the_bits_of_its_single_run(peaks_from: float | None) -> None:
    betas = [None, 0.0, *RNG.uniform(0.1, 1.2, 25).tolist()]
    specimens = [Specimen(beta=beta) for beta in betas]
    drives: list[Excitation] = [
        (start(16.0 + 0.2 * i), record(1.0 + 0.1 * i), SineProgram([Sweep.dwell(6.0, 1.24, 17.0)]))[i % 3]
        for i in range(len(betas))
    ]
    states = [State() if beta is None or i % 2 else State(theta=0.01, omega=0.1) for i, beta in enumerate(betas)]
    motions = simulate_many(specimens, drives, states=states, peaks_from=peaks_from)
    for i, motion in enumerate(motions):
        alone = simulate(specimens[i], drives[i], state=states[i], peaks_from=peaks_from)
        assert same(motion, alone), (i, motion, alone)
    endings = {motion.status for motion in motions}
    assert Status.COMPLETED in endings
    assert endings & {Status.OVERTURNED_A, Status.OVERTURNED_B}
    assert min(motion.impacts for motion in motions) == 0
    assert max(motion.impacts for motion in motions) > 50


def test_a_larger_angle_of_rest_saves_impacts_and_changes_no_peak_by_more() -> None:
    specimens, motion = [Specimen(beta=beta) for beta in (0.25, 0.4, 0.64)], record(1.1)
    exact, rough = (simulate_many(specimens, motion, rest_angle=angle) for angle in (1e-12, 1e-8))
    for one, other in zip(exact, rough, strict=True):
        assert one.status is other.status is Status.COMPLETED
        assert 30 < other.impacts < 0.6 * one.impacts
        assert one.peaks is not None
        assert other.peaks is not None
        assert other.peaks.drift == pytest.approx(one.peaks.drift, rel=1e-6)
        assert other.peaks.theta == pytest.approx(one.peaks.theta, abs=1e-7)


def test_a_member_that_fails_ends_alone() -> None:
    wild = State(v1=1e9, theta=0.01)
    motions = simulate_many(Specimen(beta=0.4), start(17.0), states=[State(), wild, State()])
    assert motions[1].status is Status.FAILED
    assert same(motions[0], simulate(Specimen(beta=0.4), start(17.0)))
    assert same(motions[2], motions[0])


def test_without_compilation_the_series_is_the_same_to_rounding() -> None:
    n, p, row = 12, Specimen(beta=0.64).packed(), np.array([1.0, 1.2, 0.1, 0.0, 0.0, 0.3, 17.0, 0.2, 0.0, 0.0])
    found: list[np.ndarray] = []
    compiled: list[Any] = [recurrences.forcing, recurrences.rocking, recurrences.resting]
    for forcing, rocking, resting in (compiled, [each.py_func for each in compiled]):
        a, c, r, w = np.zeros(n + 1), np.zeros((6, n + 1)), np.zeros((6, n + 1)), np.zeros((WORK_ROWS, n + 1))
        c[:, 0] = 0.003, 0.004, 0.05, -0.08, -0.02, -0.3
        r[:4, 0] = c[:4, 0]
        forcing(row, 0.1, a, n)
        rocking(p, -1.0, a, c, w, n)
        resting(p, a, r, n)
        found.append(np.concatenate((a[None], c, r)))
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_the_arithmetic_of_lanes_has_a_meaning_in_python() -> None:
    a, b = np.zeros(2), np.zeros((2, 2))
    put(a, 1, 3.0)
    put2(b, 1, 0, 4.0)
    assert (get(a, 1), get2(b, 1, 0), fma(2.0, 3.0, 4.0), zero(a)) == (3.0, 4.0, 10.0, 0.0)
    assert some(1.0)
    assert not some(0.0)
