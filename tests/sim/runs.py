"""Short ways to the kernel for tests that need more of it than `simulate` offers."""

from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from sim.kernel import rocking as kernel
from sim.specimen import Specimen

A_S = 1.01 * 9.81 / 8.0
"""The paper's harmonic amplitude [m/s2], Eq. (11)."""


def kernel_run(
    specimen: Specimen,
    segments: NDArray[np.float64],
    start: NDArray[np.float64],
    *,
    times: NDArray[np.float64] | None = None,
    order: int = 20,
    tolerance: float = 1e-13,
    longest_step: float = inf,
    rest_angle: float = 0.0,
    impacts: int = 1_000_000,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """End state, report and samples of `sim.kernel.rocking.run`."""
    x, report = start.copy(), np.empty(kernel.REPORT)
    times = np.empty(0) if times is None else times
    samples = np.full((times.size, 6), np.nan)
    kernel.run(
        specimen.packed(),
        segments,
        x,
        times,
        samples,
        order,
        tolerance,
        longest_step,
        0.5 * pi,
        rest_angle,
        0.0,
        impacts,
        report,
    )
    return x, report, samples
