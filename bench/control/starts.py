"""Start-ups that bring the block to its steady rocking motion, planned with the model before the test.

At many points, switching the sine on overturns the block; at high frequencies it leaves the block at rest. The
transient is chaotic and the specimen is uncertain, so each candidate is simulated with specimens drawn from the
identification's uncertainty and with slightly different drives. A few draws select candidates and new draws rate those
that remain, so the stated probability is not biased by the selection. Each selection round simulates the candidates in
order of preference, by successes so far and then by duration, and ends once enough of them have succeeded with every
draw, since a later candidate could not displace them.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.control.oscillator import Segment, program
from bench.result_cache import cached
from sim.ensemble import simulate_many
from sim.knowledge import SpecimenKnowledge
from sim.rocking import Motion, Status
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbits

Counts = NDArray[np.float64]

TOPS = (22.0, 24.0, 26.0, 28.0)
"""Frequencies [rad/s] of the ramp before a downward sweep; only those above the requested frequency are tried."""

RAMPS = ((6.0, 0.0), (12.0, 0.0), (6.0, 10.0))
"""Durations [s] of the ramp before a downward sweep, and of the wait between ramp and sweep."""

CHIRPS = (0.5, 1.0)
"""Rates of the downward frequency sweep, or chirp [rad/s per s]."""

DIRECT_RAMPS = (8.0, 16.0)
"""Durations [s] of a ramp directly at the requested frequency."""

OVERSHOOTS = (1.0, 1.2)
"""Ratios of the amplitude of ramp and chirp to the requested amplitude; a larger amplitude can uplift a block that
would otherwise stay at rest.
"""

EASE = 6.0
"""Duration [s] of the reduction of an overshoot to the requested amplitude, at the requested frequency."""


@dataclass(frozen=True)
class Candidate:
    """A candidate start-up: its last sweep ends at the requested amplitude and frequency."""

    name: str
    segments: tuple[Segment, ...]

    @property
    def duration(self) -> float:
        """Total duration of the segments [s]."""
        return sum(segment.duration for segment in self.segments)


def candidates(omega: float, amplitude: float) -> list[Candidate]:
    """All candidate start-ups to `amplitude` [m/s2] at `omega` [rad/s]."""
    found = [_direct(omega, amplitude, *values) for values in product(DIRECT_RAMPS, OVERSHOOTS)]
    above = [top for top in TOPS if top > omega]
    found += [_from_above(omega, amplitude, *values) for values in product(above, RAMPS, CHIRPS, OVERSHOOTS)]
    return found


def _direct(omega: float, amplitude: float, ramp: float, overshoot: float) -> Candidate:
    segments = [Segment(ramp, overshoot * amplitude, omega)]
    return _candidate(f"ramp {ramp:g} s at {omega:g} rad/s", segments, amplitude, overshoot)


def _from_above(
    omega: float, amplitude: float, top: float, ramp: tuple[float, float], rate: float, overshoot: float
) -> Candidate:
    rise, wait = ramp
    high = overshoot * amplitude
    segments = [Segment(rise, high, top)]
    name = f"ramp {rise:g} s at {top:g} rad/s"
    if wait > 0.0:
        segments.append(Segment(wait, high, top))
        name += f", wait {wait:g} s"
    segments.append(Segment((top - omega) / rate, high, omega))
    return _candidate(f"{name}, chirp {rate:g} rad/s per s", segments, amplitude, overshoot)


def _candidate(name: str, segments: list[Segment], amplitude: float, overshoot: float) -> Candidate:
    if overshoot != 1.0:
        segments = [*segments, Segment(EASE, amplitude, segments[-1].omega)]
        name += f", {overshoot:g} x amplitude"
    return Candidate(name, tuple(segments))


DRIVE = 0.03
"""Relative half width of the uniform distribution of the table's amplitude during a start-up, before amplitude control
takes effect.
"""

SIEVES = ((5, 2.0), (10, 1.0))
"""For each selection round: number of draws, and number of candidates kept per requested start-up."""

RATING = 32
"""Number of draws with which the remaining candidates are rated."""

SEED = 1
"""Random seed of the draws, for reproducible results."""

DWELL, WINDOW = 40.0, 4.0
"""Simulated time [s] at the requested frequency, and duration [s] of its evaluated last part."""

TOLERANCE = 1e-7
"""Relative tolerance of the simulations."""

CATCH_ANGLE = 0.35
"""Tilt [rad] beyond which the block counts as fallen."""

CLOSE = 0.10
"""Relative difference between the peaks of drift and tilt and those of the orbit, below which a motion counts as
converging to the orbit.
"""


@dataclass(frozen=True)
class Start:
    """A start-up to the steady state: its sweeps end at the requested amplitude and frequency.

    `chance`, between 0 and 1, is estimated from s successes of n draws as (s + 1) / (n + 2) (rule of succession).
    """

    name: str
    segments: tuple[Segment, ...]
    chance: float

    @property
    def duration(self) -> float:
        """Total duration of the segments [s]."""
        return sum(segment.duration for segment in self.segments)


@dataclass(frozen=True, eq=False)
class _Case:
    """A drawn specimen, the relative amplitude of the drive, and the orbit of this specimen under this drive."""

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
    """The `count` most robust start-ups to `amplitude` [m/s2] at `omega` [rad/s], best first, shorter first among
    equals.

    `orbit` is the rocking orbit of `specimen`, None if it does not exist. A start-up succeeds with a drawn specimen if
    the simulated motion ends close to that specimen's stable orbit or, if there is no such orbit, if the block remains
    standing. Raises InvalidInput for a bare frame or an invalid number. Results are cached.
    """
    allowed = uncertainty or SpecimenKnowledge()
    aim = None if orbit is None else [*orbit.section.tolist(), orbit.peaks.drift, orbit.peaks.theta, orbit.stable]
    inputs = [specimen.model_dump(mode="json"), omega, amplitude, aim, count, allowed.model_dump(mode="json")]

    def search() -> list[Any]:
        found = _search(specimen, omega, amplitude, orbit, count, allowed)
        return [[start.name, [[*astuple(segment)] for segment in start.segments], start.chance] for start in found]

    stored = cached("starts", inputs, search)
    return [Start(name, tuple(Segment(*segment) for segment in segments), chance) for name, segments, chance in stored]


def _search(
    specimen: Specimen,
    omega: float,
    amplitude: float,
    orbit: Orbit | None,
    count: int,
    allowed: SpecimenKnowledge,
) -> list[Start]:
    random = np.random.default_rng(SEED)

    def cases(n: int) -> list[_Case]:
        return _cases(allowed.draws(specimen, n, random), omega, amplitude, orbit, random)

    left = candidates(omega, amplitude)
    won = np.zeros(len(left))
    most = 0
    for draws, keep in SIEVES:
        most += draws
        left, won = _best_candidates(left, won, cases(draws), round(keep * count), most)
    won = _successes(left, cases(RATING))
    chances = (won + 1.0) / (RATING + 2.0)
    return [Start(left[i].name, left[i].segments, float(chances[i])) for i in _best_first(left, won)]


def _best_candidates(
    ways: list[Candidate], won: Counts, cases: Sequence[_Case], keep: int, most: int
) -> tuple[list[Candidate], Counts]:
    """The `keep` best candidates, best first, after adding these cases, with the total number of cases in which each
    has succeeded.

    `most` is the total number of cases so far. Candidates are simulated in the order in which equals are preferred;
    once `keep` of them have succeeded in every case, the others are dropped without simulation.
    """
    order = _best_first(ways, won)
    total = won.copy()
    simulated: list[int] = []
    while len(simulated) < len(order) and np.count_nonzero(total[simulated] == most) < keep:
        batch = order[len(simulated) : len(simulated) + max(keep - np.count_nonzero(total[simulated] == most), 1)]
        total[batch] += _successes([ways[i] for i in batch], cases)
        simulated += batch
    # the sort below is stable: equally successful candidates of equal duration keep the given order
    simulated.sort()
    best = [simulated[k] for k in _best_first([ways[i] for i in simulated], total[simulated])][:keep]
    return [ways[i] for i in best], total[best]


def _cases(
    specimens: Sequence[Specimen], omega: float, amplitude: float, orbit: Orbit | None, random: np.random.Generator
) -> list[_Case]:
    drives = [1.0 + DRIVE * float(random.uniform(-1.0, 1.0)) for _ in specimens]
    amplitudes = [drive * amplitude for drive in drives]
    own: list[Orbit | None] = [None] * len(drives)
    if orbit is not None:
        own = rocking_orbits(specimens, omega, amplitudes, orbit)
    return [_Case(*each) for each in zip(specimens, drives, own, strict=True)]


def _successes(ways: Sequence[Candidate], cases: Sequence[_Case]) -> Counts:
    """Number of cases in which each candidate succeeds, shape (n,)."""
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


def _best_first(ways: Sequence[Candidate], won: Counts) -> list[int]:
    return sorted(range(len(ways)), key=lambda i: (-won[i], ways[i].duration))


def _scaled(way: Candidate, factor: float) -> list[Segment]:
    segments = [*way.segments, Segment(DWELL, way.segments[-1].amplitude, way.segments[-1].omega)]
    return [replace(segment, amplitude=factor * segment.amplitude) for segment in segments]


def _success(motion: Motion, orbit: Orbit | None) -> bool:
    if motion.status is not Status.COMPLETED:
        return False
    if orbit is None or not orbit.stable:
        return True
    drift = motion.peaks.drift / orbit.peaks.drift - 1.0
    theta = motion.peaks.theta / orbit.peaks.theta - 1.0
    return abs(drift) < CLOSE and abs(theta) < CLOSE
