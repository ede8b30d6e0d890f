"""Recordings of free rocking for tests: the exact motion as a laser of a stated kind shows it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.swings import Recording
from sim import block_face
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter, theoretical_restitution
from sim.specimen import Block, Specimen

BLOCK = Block()
SPECIMEN = Specimen(block=BLOCK)
ALPHA, P = critical_angle(BLOCK), frequency_parameter(BLOCK, SPECIMEN.g)
R_TH = theoretical_restitution(BLOCK)
RATE, HEIGHT = 2000.0, 0.3


@dataclass(frozen=True)
class Shown:
    """How a laser shows the block's face: noise and steps [m], bend [1/m], scale, offset [m]."""

    noise: float = 2e-5
    step: float = 0.0
    bend: float = 0.0
    scale: float = 1.0
    offset: float = 0.003


def motion(
    share: float, factor: float = 0.992, alpha: float = ALPHA, p: float = P, trend: float = 0.0, start: float = 2.5
) -> FreeRocking:
    """The block let go from `share` of its critical angle."""
    return FreeRocking(alpha, p, factor * R_TH, share * alpha, start, trend, 0.5)


def recording(of: FreeRocking, shown: Shown | None = None, seed: int = 1, *, settle: float = 3.0) -> Recording:
    """The whole motion and some seconds of rest."""
    shown = shown or Shown()
    times = np.arange(0.0, of.rest_time + settle, 1.0 / RATE)
    moved = block_face.displacement(of.angle(times), HEIGHT, BLOCK)
    seen: NDArray[np.float64] = shown.offset + shown.scale * (moved + shown.bend * moved**2)
    seen = seen + shown.noise * np.random.default_rng(seed).standard_normal(seen.size)
    if shown.step > 0.0:
        seen = shown.step * np.rint(seen / shown.step)
    return Recording(seen, RATE, BLOCK, HEIGHT)
