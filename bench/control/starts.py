"""How to bring the block onto its steady rocking motion: planned with the model before anything moves.

Switching the sine on topples the block at many points, and near high frequencies it leaves it at rest. Most often a
soft ramp well above the asked frequency, followed by a slow chirp down, works; the transient is chaotic, so each
candidate is simulated with the specimen and the drive a little off, and the most robust one comes first.
"""

from dataclasses import dataclass, replace
from itertools import product

from bench.control.legs import Leg, program
from sim.rocking import Motion, Status, simulate_many
from sim.specimen import Specimen
from sim.steady import Orbit

TOPS = (22.0, 24.0, 26.0, 28.0)
"""Frequencies [rad/s] of the soft ramp: where the block rocks little and the frame is far from resonance."""

RAMPS = (6.0, 12.0)
"""Lengths of the soft ramp [s]."""

CHIRPS = (0.5, 1.0)
"""Rates at which the frequency comes down [rad/s per s]."""

OVERSHOOTS = (1.0, 1.2)
"""Amplitude of ramp and chirp over the asked one: more lifts a block that would stay at rest."""

EASE = 6.0
"""Time in which an overshoot is taken back at the asked frequency [s]."""

DWELL, WINDOW = 40.0, 4.0
"""Time that is simulated at the asked frequency, and its last part that is judged [s]."""

CATCH_ANGLE = 0.35
"""Tilt [rad] that counts as fallen: beyond it no spring of the campaign brings the block back."""

CLOSE = 0.10
"""Relative distance of the peaks of drift and tilt at which a motion counts as on its way to the orbit."""

OFFSETS = (
    # amplitude, restitution, spring: what the drive's control and the specimen's identification leave open
    (1.00, 1.000, 1.00),
    (0.97, 1.000, 1.00),
    (1.03, 1.000, 1.00),
    (1.00, 0.992, 1.00),
    (1.00, 1.000, 0.97),
    (1.00, 1.000, 1.03),
)


@dataclass(frozen=True)
class Start:
    """A way to the steady state: its legs end at the asked amplitude and frequency; `chance` is 0 to 1."""

    name: str
    legs: tuple[Leg, ...]
    chance: float

    @property
    def duration(self) -> float:
        """Length [s]."""
        return sum(leg.duration for leg in self.legs)


def plan_starts(specimen: Specimen, omega: float, amplitude: float, orbit: Orbit | None, count: int) -> list[Start]:
    """The `count` most robust starts to `amplitude` [m/s2] at `omega` [rad/s], best first.

    A start succeeds when the simulated motion ends close to a stable `orbit`; where there is none, when the block
    does not fall.
    """
    candidates = _candidates(omega, amplitude)
    variants = [(factor, _off(specimen, restitution, spring)) for factor, restitution, spring in OFFSETS]
    runs = [(start, factor, variant) for start in candidates for factor, variant in variants]
    motions = simulate_many(
        [variant for _, _, variant in runs],
        [program(_scaled(start, factor)) for start, factor, _ in runs],
        peaks_from=[start.duration + DWELL - WINDOW for start, _, _ in runs],
        tolerance=1e-7,
        overturning_angle=CATCH_ANGLE,
    )
    good = [_success(motion, orbit) for motion in motions]
    n = len(OFFSETS)
    rated = [replace(start, chance=sum(good[i * n : (i + 1) * n]) / n) for i, start in enumerate(candidates)]
    return sorted(rated, key=lambda start: (-start.chance, start.duration))[:count]


def _off(specimen: Specimen, restitution: float, spring: float) -> Specimen:
    block = specimen.block.model_copy(update={"restitution_factor": specimen.block.restitution_factor * restitution})
    return specimen.model_copy(update={"block": block, "beta": (specimen.beta or 0.0) * spring})


def _candidates(omega: float, amplitude: float) -> list[Start]:
    found: list[Start] = []
    for top, ramp, rate, overshoot in product(TOPS, RAMPS, CHIRPS, OVERSHOOTS):
        high = max(top, omega)
        name = f"ramp {ramp:g} s at {high:g} rad/s, chirp {rate:g} rad/s per s"
        legs = [Leg(ramp, overshoot * amplitude, high)]
        if high > omega:
            legs.append(Leg((high - omega) / rate, overshoot * amplitude, omega))
        if overshoot != 1.0:
            legs.append(Leg(EASE, amplitude, omega))
            name += f", {overshoot:g} x amplitude"
        found.append(Start(name, tuple(legs), 0.0))
    return list({start.legs: start for start in found}.values())


def _scaled(start: Start, factor: float) -> list[Leg]:
    legs = [*start.legs, Leg(DWELL, start.legs[-1].amplitude, start.legs[-1].omega)]
    return [replace(leg, amplitude=factor * leg.amplitude) for leg in legs]


def _success(motion: Motion, orbit: Orbit | None) -> bool:
    if motion.status is not Status.COMPLETED:
        return False
    if orbit is None or not orbit.stable:
        return True
    drift = motion.peaks.drift / orbit.peaks.drift - 1.0
    theta = motion.peaks.theta / orbit.peaks.theta - 1.0
    return abs(drift) < CLOSE and abs(theta) < CLOSE
