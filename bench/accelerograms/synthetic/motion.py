"""A synthetic record: noise of the ground, and the velocity pulse of a fault that is near."""

from hashlib import sha256
from math import ceil

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.synthetic.noise import DECAYED, SIGNIFICANT, shot_noise
from bench.accelerograms.synthetic.shapes import NAMES, SHAPES, Pulse, Shape
from bench.accelerograms.units import STANDARD_GRAVITY
from bench.analysis.table_motion import at_rest_in_the_end
from sim.errors import InvalidInput

Array = NDArray[np.float64]

DT = 0.01
"""Step of the synthetic records [s]."""

DEFAULT_SEED = 1

HASHED = 1e-6
"""Acceleration [m/s2] to which a record is rounded for its hash: beyond it, machines may differ."""

FADING = 1.5
"""Time for the filters to fade after the noise, in periods of the high-pass."""


def synthetic_record(name: str, seed: int = DEFAULT_SEED) -> Accelerogram:
    """A ground motion with the main numbers of the record `name`, one of NAMES; made, not measured.

    Peak exact, duration and band as declared in the mean over seeds; it begins and ends at rest, velocity and
    displacement included. The same seed gives the same record everywhere, to rounding. Raises InvalidInput.
    """
    if name not in SHAPES:
        raise InvalidInput("synthetic record", name, f"there are {', '.join(NAMES)}")
    if seed < 0:
        raise InvalidInput("seed", seed, "it must be a whole number, at least 0")
    shape = SHAPES[name]
    acceleration = _motion(shape, seed, NAMES.index(name))
    rounded = np.round(acceleration / HASHED).astype("<i8")
    low, high = shape.band
    header = {
        "kind": "synthetic motion, not a measurement",
        "method": "filtered shot noise (Kanai, Tajimi, Clough and Penzien; envelope of Saragoni and Hart)",
        "pulse": "none",
        "seed": str(seed),
        "declared peak": f"{shape.peak:g} g",
        "declared duration": f"{shape.duration:g} s between 5 and 95 % of the Arias intensity",
        "declared band": f"{low:g} to {high:g} Hz, the middle 68 % of the energy",
    }
    if shape.pulse is not None:
        pulse = shape.pulse
        header["pulse"] = f"{pulse.velocity:g} m/s, {pulse.period:g} s (Mavroeidis and Papageorgiou 2003)"
    return Accelerogram(
        name=f"synthetic {name}",
        acceleration=acceleration,
        dt=DT,
        source=f"synthetic, seed {seed}",
        format="synthetic",
        unit="m/s2",
        sha256=sha256(rounded.tobytes()).hexdigest(),
        header=header,
        synthetic=True,
    )


def _motion(shape: Shape, seed: int, member: int) -> Array:
    """The noise is as strong as gives the declared peak together with the pulse."""
    from scipy.optimize import brentq

    rate = SIGNIFICANT / shape.significant
    n = ceil((DECAYED / rate + FADING / shape.ground[2]) / DT) + 1
    noise = at_rest_in_the_end(shot_noise(seed, member, n, DT, shape.significant, shape.ground), DT)
    noise /= np.abs(noise).max()
    peak = shape.peak * STANDARD_GRAVITY
    if shape.pulse is None:
        return peak * noise
    time = np.asarray(np.arange(n) * DT - 1.0 / rate, dtype=np.float64)
    pulse = at_rest_in_the_end(pulse_acceleration(shape.pulse, time), DT)

    def excess(level: float) -> float:
        return float(np.abs(pulse + level * noise).max()) - peak

    whole = pulse + float(brentq(excess, 0.0, 2.0 * peak)) * noise
    return whole * (peak / np.abs(whole).max())


def pulse_acceleration(pulse: Pulse, time: Array) -> Array:
    """Acceleration [m/s2] of the pulse at `time` [s] from its middle, same shape.

    v = V/2 (1 + cos(2 pi t / (gamma T))) cos(2 pi t / T + nu) for |t| < gamma T / 2; a whole gamma leaves no
    displacement behind. Source: Mavroeidis and Papageorgiou, Bull. Seism. Soc. Am. 93, 2003.
    """
    omega = 2.0 * np.pi / pulse.period
    slow, fast = omega / pulse.gamma * time, omega * time + pulse.phase
    rate = np.sin(slow) / pulse.gamma * np.cos(fast) + (1.0 + np.cos(slow)) * np.sin(fast)
    return np.where(np.abs(slow) < np.pi, -0.5 * pulse.velocity * omega * rate, 0.0)
