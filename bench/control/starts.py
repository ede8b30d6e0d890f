"""How to bring the block onto its steady rocking motion: planned with the model before anything moves.

Switching the sine on topples the block at many points, and near high frequencies it leaves it at rest. The transient
is chaotic and the specimen is known so well only, so each candidate is simulated with specimens drawn from what the
identification leaves open, and with the drive a little off. A few draws sift the candidates, fresh ones rate those
that are left: the chance that is stated is not the luck of the draws that chose them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.control.candidates import Candidate, candidates
from bench.control.legs import Leg, program
from sim.knowledge import SpecimenKnowledge
from sim.rocking import Motion, Status, simulate_many
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, rocking_orbit

DRIVE = 0.03
"""Relative half width of the table's amplitude during a start, before the amplitude's control has closed on it."""

SIEVES = ((5, 2.0), (10, 1.0))
"""Draws of each sifting, and how many candidates it leaves for each start that is asked for."""

RATING = 32
"""Draws that rate the candidates that are left."""

SEED = 1
"""Of the draws: the same question has the same answer."""

DWELL, WINDOW = 40.0, 4.0
"""Time that is simulated at the asked frequency, and its last part that is judged [s]."""

TOLERANCE = 1e-7
"""Of the simulations."""

CATCH_ANGLE = 0.35
"""Tilt [rad] that counts as fallen: beyond it no spring of the campaign brings the block back."""

CLOSE = 0.10
"""Relative distance of the peaks of drift and tilt at which a motion counts as on its way to the orbit."""


@dataclass(frozen=True)
class Start:
    """A way to the steady state: its legs end at the asked amplitude and frequency.

    `chance`, between 0 and 1, is estimated from s successes of n draws as (s + 1) / (n + 2) (rule of succession).
    """

    name: str
    legs: tuple[Leg, ...]
    chance: float

    @property
    def duration(self) -> float:
        """Length [s]."""
        return sum(leg.duration for leg in self.legs)


@dataclass(frozen=True, eq=False)
class _Case:
    """A specimen as it may be, the drive's relative amplitude, and the specimen's own orbit under that drive."""

    specimen: Specimen
    drive: float
    orbit: Orbit | None


def plan_starts(
    specimen: Specimen,
    omega: float,
    amplitude: float,
    orbit: Orbit | None,
    count: int,
    uncertainty: SpecimenKnowledge | None = None,
) -> list[Start]:
    """The `count` most robust starts to `amplitude` [m/s2] at `omega` [rad/s], best first, the shorter one of equals.

    `orbit` is the rocking orbit of `specimen`, None where there is none. A start succeeds with a drawn specimen when
    the simulated motion ends close to that specimen's own stable orbit; where it has none, when the block stands.
    Raises InvalidInput for a bare frame or meaningless numbers.
    """
    random = np.random.default_rng(SEED)
    allowed = uncertainty or SpecimenKnowledge()

    def cases(n: int) -> list[_Case]:
        return _cases(allowed.draws(specimen, n, random), omega, amplitude, orbit, random)

    left = candidates(omega, amplitude)
    won = np.zeros(len(left))
    for draws, keep in SIEVES:
        won = won + _successes(left, cases(draws))
        order = _best_first(left, won)[: round(keep * count)]
        left, won = [left[i] for i in order], won[order]
    won = _successes(left, cases(RATING))
    chances = (won + 1.0) / (RATING + 2.0)
    return [Start(left[i].name, left[i].legs, float(chances[i])) for i in _best_first(left, won)]


def _cases(
    specimens: Sequence[Specimen], omega: float, amplitude: float, orbit: Orbit | None, random: np.random.Generator
) -> list[_Case]:
    found: list[_Case] = []
    for specimen in specimens:
        drive = 1.0 + DRIVE * float(random.uniform(-1.0, 1.0))
        own = None if orbit is None else _own_orbit(specimen, omega, drive * amplitude, orbit)
        found.append(_Case(specimen, drive, own))
    return found


def _own_orbit(specimen: Specimen, omega: float, amplitude: float, guess: Orbit) -> Orbit | None:
    try:
        return rocking_orbit(specimen, omega, amplitude, guess=guess)
    except NoOrbit:
        return None


def _successes(ways: Sequence[Candidate], cases: Sequence[_Case]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """In how many of the cases each candidate succeeds, shape (n,)."""
    runs = [(way, case) for way in ways for case in cases]
    motions = simulate_many(
        [case.specimen for _, case in runs],
        [program(_scaled(way, case.drive)) for way, case in runs],
        peaks_from=[way.duration + DWELL - WINDOW for way, _ in runs],
        tolerance=TOLERANCE,
        overturning_angle=CATCH_ANGLE,
    )
    good = [_success(motion, case.orbit) for motion, (_, case) in zip(motions, runs, strict=True)]
    return np.array(good, dtype=np.float64).reshape(len(ways), len(cases)).sum(axis=1)


def _best_first(ways: Sequence[Candidate], won: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[int]:
    return sorted(range(len(ways)), key=lambda i: (-won[i], ways[i].duration))


def _scaled(way: Candidate, factor: float) -> list[Leg]:
    legs = [*way.legs, Leg(DWELL, way.legs[-1].amplitude, way.legs[-1].omega)]
    return [replace(leg, amplitude=factor * leg.amplitude) for leg in legs]


def _success(motion: Motion, orbit: Orbit | None) -> bool:
    if motion.status is not Status.COMPLETED:
        return False
    if orbit is None or not orbit.stable:
        return True
    drift = motion.peaks.drift / orbit.peaks.drift - 1.0
    theta = motion.peaks.theta / orbit.peaks.theta - 1.0
    return abs(drift) < CLOSE and abs(theta) < CLOSE
