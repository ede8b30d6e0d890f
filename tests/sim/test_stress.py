"""The short form of `tests.benchmarks.stress`, and scenes that hypothesis thinks of."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.rocking import State, Status, simulate
from sim.specimen import Block, Specimen
from tests.benchmarks.stress import run_chunk, shares, table
from tests.benchmarks.stress_audit import audit
from tests.benchmarks.stress_cases import KINDS, Case

CASES, SEED = 3000, 20


@pytest.mark.parametrize("kind", list(KINDS))
def test_no_scene_breaks_a_rule(kind: str) -> None:
    tally = run_chunk(kind, SEED, 0, shares(CASES)[kind])
    assert not tally.offenders, tally.offenders[0]
    assert tally.cases == shares(CASES)[kind]
    # a status that gives up is explicit, but only a spring turned inside out may end so
    assert tally.outcomes[Status.FAILED.value] <= 0.01 * tally.cases
    print(table({kind: tally}))


def test_the_kinds_do_what_they_are_for() -> None:
    assert run_chunk("grazing returns", SEED, 0, 200).impacts > 60
    assert run_chunk("chatter", SEED, 0, 50).impacts > 5000
    thrown = run_chunk("near overturning", SEED, 0, 200).outcomes
    assert thrown[Status.OVERTURNED_A.value] > 15 < thrown[Status.OVERTURNED_B.value]
    assert thrown[Status.COMPLETED.value] > 60


SIGNED = st.floats(-1.0, 1.0)
SMALL_OR_LARGE = st.floats(-6.0, 3.0).map(lambda power: 10.0**power)


@settings(max_examples=120, deadline=None)
@given(
    st.lists(SIGNED, min_size=2, max_size=12),
    st.floats(-4.0, -1.0).map(lambda power: 10.0**power),
    SMALL_OR_LARGE,
    st.one_of(st.just(0.0), st.floats(0.0, 100.0)),
    st.floats(0.75, 200.0),
    st.floats(0.0, 1.0),
    st.tuples(SIGNED, SIGNED, SIGNED, SIGNED, SIGNED, SIGNED),
    st.floats(0.0, 0.999),
)
def test_records_of_any_shape(
    values: list[float],
    dt: float,
    size: float,
    beta: float,
    slenderness: float,
    factor: float,
    state: tuple[float, ...],
    choice: float,
) -> None:
    specimen = Specimen(beta=beta, block=Block(b=0.2 / slenderness, restitution_factor=factor))
    u1, u2, v1, v2, theta, omega = state
    start = State(0.09 * u1, 0.2 * u2, v1, v2, theta / slenderness, omega)
    drive = SampledRecord(specimen.uplift_acceleration * size * np.array(values), dt)
    motion, faults = audit(Case(specimen, drive, start), choice)
    assert not faults
    assert motion.status in Status


@settings(max_examples=80, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(1e-3, 0.5), st.tuples(SIGNED, SIGNED), st.floats(0.1, 300.0), st.floats(0.1, 300.0)),
        min_size=1,
        max_size=4,
    ),
    SMALL_OR_LARGE,
    st.floats(0.0, 2.0),
    st.floats(0.0, 0.999),
)
def test_sweeps_of_any_shape(
    sweeps: list[tuple[float, tuple[float, float], float, float]], size: float, beta: float, choice: float
) -> None:
    specimen = Specimen(beta=beta)
    scale = specimen.uplift_acceleration * size
    program = SineProgram(
        [Sweep(time, (scale * first, scale * last), (begin, end)) for time, (first, last), begin, end in sweeps]
    )
    _, faults = audit(Case(specimen, program), choice)
    assert not faults


def test_an_endless_bounce_ends() -> None:
    # restitution 1: the bounces neither die nor stop, and the run still ends with the record
    block = Block(restitution_factor=1.0 / Block().restitution)
    motion = simulate(
        Specimen(beta=0.0, block=block), SampledRecord(np.zeros(2), 0.5), state=State(theta=1e-11), tolerance=1e-9
    )
    assert motion.status is Status.COMPLETED
    assert motion.impacts > 10_000
    assert motion.peaks.theta == pytest.approx(1e-11, rel=1e-6)
