"""Planned starts: robust first, honest about what works, and ending where the test is to be."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.control import starts
from bench.control.oscillator import Segment, program
from bench.control.starts import CATCH_ANGLE, RATING, TOPS, Start, candidates, plan_starts
from bench.engine.steps import Publish
from bench.events import StepStarted
from protocols.harmonic.protocol import PointStatus
from sim.ensemble import simulate_many
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.rocking import Motion, simulate
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit
from tests.protocols.harmonic.scripted import BETA, OMEGA, PARAMETERS, Script, cycle

AMPLITUDE = 1.01 * 9.81 / 8.0


def _tested(specimen: Specimen, start: Start, drive: float = 1.0, dwell: float = 150.0) -> Motion:
    """What the start leads to; the last 10 s of the dwell are watched."""
    segments = [Segment(segment.duration, drive * segment.amplitude, segment.omega) for segment in start.segments]
    held = Sweep.dwell(dwell, drive * start.segments[-1].amplitude, start.segments[-1].omega)
    return simulate(
        specimen,
        SineProgram([*program(segments).sweeps, held]),
        peaks_from=start.duration + dwell - 10.0,
        overturning_angle=CATCH_ANGLE,
    )


def _orbit(specimen: Specimen, omega: float) -> Orbit:
    branch = predict_gain(specimen, omega, AMPLITUDE).rocking
    assert branch is not None
    return branch.orbit


@pytest.mark.parametrize(
    ("omega", "beta"),
    [
        (20.0, 0.64),
        *(
            pytest.param(*each, marks=pytest.mark.soak)
            for each in ((12.5, 0.25), (17.5, 0.64), (12.5, 0.97), (17.5, 0.97), (20.0, 0.97))
        ),
    ],
)
def test_the_first_start_leads_to_the_orbit(omega: float, beta: float) -> None:
    specimen = Specimen().coupled(beta)
    orbit = _orbit(specimen, omega)
    start, *others = plan_starts(specimen, omega, AMPLITUDE, orbit, 4)
    assert len(others) == 3
    assert start.chance > 0.9
    chances = [start.chance, *(other.chance for other in others)]
    assert chances == sorted(chances, reverse=True)
    assert start.segments[-1].amplitude == AMPLITUDE
    assert start.segments[-1].omega == omega
    motion = _tested(specimen, start)
    assert motion.peaks.drift == pytest.approx(orbit.peaks.drift, rel=0.02)
    assert motion.peaks.theta == pytest.approx(orbit.peaks.theta, rel=0.02)


def test_where_two_branches_exist_the_block_is_lifted_off_its_rest() -> None:
    """At beta = 0.25 and 20 rad/s a soft start without overshoot leaves the block at rest."""
    specimen = Specimen().coupled(0.25)
    found = predict_gain(specimen, 20.0, AMPLITUDE)
    assert found.rocking is not None
    assert found.resting is not None
    start = plan_starts(specimen, 20.0, AMPLITUDE, found.rocking.orbit, 1)[0]
    assert start.chance > 0.9
    assert max(segment.amplitude for segment in start.segments) > AMPLITUDE


def test_where_the_orbit_is_unstable_a_start_only_has_to_keep_the_block_standing() -> None:
    specimen = Specimen().coupled(0.97)
    orbit = _orbit(specimen, 15.0)
    assert not orbit.stable
    assert plan_starts(specimen, 15.0, AMPLITUDE, orbit, 2)[0].chance > 0.5


@pytest.mark.parametrize("rank", [pytest.param(0, marks=pytest.mark.soak), 5])
def test_the_stated_chance_is_what_other_draws_find(rank: int) -> None:
    """Other specimens, a longer dwell, a narrower criterion: as many reach their own orbit, within 3 sigma."""
    specimen, n = Specimen().coupled(0.97), 60
    orbit = _orbit(specimen, 17.5)
    start = plan_starts(specimen, 17.5, AMPLITUDE, orbit, 6)[rank]
    random = np.random.default_rng(77)
    reached = 0
    for other in SpecimenKnowledge().draws(specimen, n, random):
        drive = 1.0 + random.uniform(-0.03, 0.03)
        own = rocking_orbit(other, 17.5, drive * AMPLITUDE, guess=orbit)
        motion = _tested(other, start, drive, dwell=80.0)
        reached += abs(motion.peaks.drift / own.peaks.drift - 1.0) < 0.05
    spread = np.sqrt(start.chance * (1.0 - start.chance) * (1.0 / n + 1.0 / RATING))
    assert abs(reached / n - start.chance) < 3.0 * spread + 1.0 / RATING


@pytest.fixture(scope="module")
def usual() -> list[Start]:
    """Four starts at beta = 0.97 and 20 rad/s."""
    specimen = Specimen().coupled(0.97)
    return plan_starts(specimen, 20.0, AMPLITUDE, _orbit(specimen, 20.0), 4)


def test_a_chance_is_never_certain_and_the_same_question_has_the_same_answer(usual: list[Start]) -> None:
    specimen = Specimen().coupled(0.97)
    first = plan_starts(specimen, 20.0, AMPLITUDE, _orbit(specimen, 20.0), 4)
    assert first == usual
    for start in first:
        successes = start.chance * (RATING + 2) - 1.0
        assert successes == pytest.approx(round(successes), abs=1e-9)
        assert 0 <= round(successes) <= RATING
        assert 0.0 < start.chance < 1.0


def _in_full(specimen: Specimen, omega: float, orbit: Orbit, count: int) -> tuple[list[Start], int]:
    """Every candidate of each sieve simulated with every draw; and how many simulations that takes."""
    random, knowledge = np.random.default_rng(starts.SEED), SpecimenKnowledge()

    def cases(n: int) -> list[Any]:
        return starts._cases(knowledge.draws(specimen, n, random), omega, AMPLITUDE, orbit, random)

    left, simulated = candidates(omega, AMPLITUDE), 0
    won = np.zeros(len(left))
    for draws, keep in starts.SIEVES:
        won, simulated = won + starts._successes(left, cases(draws)), simulated + draws * len(left)
        order = starts._best_first(left, won)[: round(keep * count)]
        left, won = [left[i] for i in order], won[order]
    won, simulated = starts._successes(left, cases(RATING)), simulated + RATING * len(left)
    chances = (won + 1.0) / (RATING + 2.0)
    order = starts._best_first(left, won)
    return [Start(left[i].name, left[i].segments, float(chances[i])) for i in order], simulated


@pytest.fixture
def simulations(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of motions that were simulated to plan starts."""
    counted: list[int] = []

    def count(specimens: list[Specimen], *arguments: object, **options: object) -> list[Motion]:
        counted.append(len(specimens))
        return simulate_many(specimens, *arguments, **options)

    monkeypatch.setattr(starts, "simulate_many", count)
    return counted


@pytest.mark.parametrize(("beta", "omega"), [pytest.param(0.25, 15.0, marks=pytest.mark.soak), (0.97, 15.0)])
def test_candidates_that_cannot_be_chosen_any_more_are_not_simulated(
    beta: float, omega: float, simulations: list[int]
) -> None:
    specimen = Specimen().coupled(beta)
    orbit = _orbit(specimen, omega)
    expected, in_full = _in_full(specimen, omega, orbit, 4)
    simulations.clear()
    assert plan_starts(specimen, omega, AMPLITUDE, orbit, 4) == expected
    assert sum(simulations) < 0.8 * in_full


def test_a_plan_is_remembered_by_a_later_run(
    result_cache: Path, simulations: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    specimen = Specimen().coupled(0.25)
    orbit = _orbit(specimen, 20.0)
    monkeypatch.setattr(starts, "RATING", 4)
    first = plan_starts(specimen, 20.0, AMPLITUDE, orbit, 1)
    assert sum(simulations) > 0
    simulations.clear()
    assert plan_starts(specimen, 20.0, AMPLITUDE, orbit, 1) == first
    assert simulations == []
    assert len(list(result_cache.iterdir())) == 1
    plan_starts(specimen, 20.0, 1.001 * AMPLITUDE, orbit, 1)
    assert sum(simulations) > 0


def test_a_specimen_that_is_known_worse_has_smaller_chances(usual: list[Start]) -> None:
    specimen = Specimen().coupled(0.97)
    orbit = _orbit(specimen, 20.0)
    wide = SpecimenKnowledge(stiffness=0.2, damping=0.5, restitution=0.02, spring=0.4)
    doubtful = plan_starts(specimen, 20.0, AMPLITUDE, orbit, 4, wide)
    assert sum(start.chance for start in doubtful) < sum(start.chance for start in usual) - 0.5


@pytest.mark.parametrize("omega", [12.5, 25.0, 30.0])
def test_every_candidate_is_another_and_ends_as_asked(omega: float) -> None:
    found = candidates(omega, AMPLITUDE)
    assert (
        len({candidate.segments for candidate in found}) == len({candidate.name for candidate in found}) == len(found)
    )
    for candidate in found:
        assert (candidate.segments[-1].amplitude, candidate.segments[-1].omega) == (AMPLITUDE, omega)
        assert candidate.duration == pytest.approx(sum(segment.duration for segment in candidate.segments))
        assert all(segment.omega == omega or segment.omega in TOPS for segment in candidate.segments)
    assert min(len(candidate.segments) for candidate in found) == 1


def _chances_said(script: Script) -> list[str]:
    said = [
        step.event.text for step in script.steps if isinstance(step, Publish) and isinstance(step.event, StepStarted)
    ]
    return [text.rpartition("chance ")[2] for text in said if "start " in text]


@pytest.fixture(scope="module")
def planned() -> list[Start]:
    """The starts of the scripted campaign."""
    specimen = Specimen().coupled(BETA)
    return plan_starts(specimen, OMEGA, AMPLITUDE, _orbit(specimen, OMEGA), PARAMETERS.starts)


def test_the_protocol_says_the_chance_of_each_start_and_keeps_that_of_the_one_that_was_measured(
    planned: list[Start],
) -> None:
    specimen = Specimen().coupled(BETA)
    orbit = _orbit(specimen, OMEGA)
    bare = predict_gain(specimen, OMEGA, AMPLITUDE).bare.drift
    script = Script(lambda start, k: None if start == 1 else cycle(k, orbit.peaks.drift, orbit.peaks.u1), bare)
    (point,) = script.run()
    assert _chances_said(script) == [f"{start.chance:.0%}" for start in planned[:2]]
    assert point.starts_tried == 2
    assert point.start_chance == planned[1].chance


def test_a_point_at_which_the_block_always_fell_keeps_the_chance_of_the_best_start(planned: list[Start]) -> None:
    specimen = Specimen().coupled(BETA)
    found = predict_gain(specimen, OMEGA, AMPLITUDE)
    assert found.rocking is not None
    (point,) = Script(lambda *_: None, found.bare.drift).run()
    assert point.status is PointStatus.OVERTURNED
    assert point.start_chance == planned[0].chance
