"""Ways that may bring the block onto its steady rocking motion: a soft ramp, a wait, a chirp to the asked frequency.

Most often a soft ramp well above the asked frequency, followed by a slow chirp down, works. Chirps that come from
below cross the frame's resonance with the block already rocking: tried over the paper's campaign, none of them was
ever among the best, so they are not among the candidates.
"""

from dataclasses import dataclass
from itertools import product

from bench.control.legs import Leg

TOPS = (22.0, 24.0, 26.0, 28.0)
"""Frequencies [rad/s] of the soft ramp: where the block rocks little and the frame is far from resonance."""

RAMPS = ((6.0, 0.0), (12.0, 0.0), (6.0, 10.0))
"""Length of the soft ramp, and of the wait between it and the chirp [s]."""

CHIRPS = (0.5, 1.0)
"""Rates at which the frequency comes down [rad/s per s]."""

DIRECT_RAMPS = (8.0, 16.0)
"""Lengths of a ramp at the asked frequency itself [s]."""

OVERSHOOTS = (1.0, 1.2)
"""Amplitude of ramp and chirp over the asked one: more lifts a block that would stay at rest."""

EASE = 6.0
"""Time in which an overshoot is taken back at the asked frequency [s]."""


@dataclass(frozen=True)
class Candidate:
    """A way to try: its legs end at the asked amplitude and frequency."""

    name: str
    legs: tuple[Leg, ...]

    @property
    def duration(self) -> float:
        """Length [s]."""
        return sum(leg.duration for leg in self.legs)


def candidates(omega: float, amplitude: float) -> list[Candidate]:
    """Every way to `amplitude` [m/s2] at `omega` [rad/s], each once."""
    found = [_direct(omega, amplitude, *values) for values in product(DIRECT_RAMPS, OVERSHOOTS)]
    above = [top for top in TOPS if top > omega]
    found += [_from_above(omega, amplitude, *values) for values in product(above, RAMPS, CHIRPS, OVERSHOOTS)]
    return found


def _direct(omega: float, amplitude: float, ramp: float, overshoot: float) -> Candidate:
    legs = [Leg(ramp, overshoot * amplitude, omega)]
    return _eased(f"ramp {ramp:g} s at {omega:g} rad/s", legs, amplitude, overshoot)


def _from_above(
    omega: float, amplitude: float, top: float, ramp: tuple[float, float], rate: float, overshoot: float
) -> Candidate:
    rise, wait = ramp
    high = overshoot * amplitude
    legs = [Leg(rise, high, top)]
    name = f"ramp {rise:g} s at {top:g} rad/s"
    if wait > 0.0:
        legs.append(Leg(wait, high, top))
        name += f", wait {wait:g} s"
    legs.append(Leg((top - omega) / rate, high, omega))
    return _eased(f"{name}, chirp {rate:g} rad/s per s", legs, amplitude, overshoot)


def _eased(name: str, legs: list[Leg], amplitude: float, overshoot: float) -> Candidate:
    if overshoot != 1.0:
        legs = [*legs, Leg(EASE, amplitude, legs[-1].omega)]
        name += f", {overshoot:g} x amplitude"
    return Candidate(name, tuple(legs))
