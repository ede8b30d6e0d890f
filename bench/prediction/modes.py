"""Frequencies and shapes of the bare frame and of the linearised coupled system, as in Fig. 3 of the paper."""

from collections.abc import Iterator, Sequence

import numpy as np

from bench.record.tables import Column, Table
from sim.linear import Modes, bare_modes, coupled_modes
from sim.specimen import Specimen


def modes_table(specimen: Specimen, betas: Sequence[float]) -> Table:
    """One row per mode: first those of the bare frame (beta NaN), then those of the coupled system at each stiffness.

    Source: Eq. (12) to (14). A divergent mode has no frequency but a rate of growth.
    """
    rows = list(_rows(float("nan"), bare_modes(specimen.frame)))
    for beta in betas:
        rows += _rows(beta, coupled_modes(specimen.coupled(beta)))
    beta, mode, omega, u1, u2, theta = (np.array(column) for column in zip(*rows, strict=True))
    divergent = omega < 0.0
    return {
        "system": Column(np.where(np.isnan(beta), "bare", "coupled"), "", "bare frame, or coupled with the block"),
        "beta": Column(beta, "1", "stiffness ratio of the coupling spring; absent for the bare frame"),
        "mode": Column(mode.astype(np.int64), "1", "number of the mode, in ascending order of the eigenvalue"),
        "divergent": Column(divergent, "1", "whether the mode grows instead of oscillating: negative stiffness"),
        "omega_rad_s": Column(np.where(divergent, np.nan, omega), "rad/s", "circular frequency; absent if divergent"),
        "frequency_hz": Column(np.where(divergent, np.nan, omega / (2.0 * np.pi)), "Hz", "frequency, likewise"),
        "growth_rate_per_s": Column(np.where(divergent, -omega, np.nan), "1/s", "rate of growth if divergent"),
        "signed_root_rad_s": Column(omega, "rad/s", "sign(lambda) sqrt|lambda|, lambda an eigenvalue of M^-1 K"),
        "shape_u1": Column(u1, "1", "displacement of the first storey in the mode; unity unless it vanishes"),
        "shape_u2": Column(u2, "1", "displacement of the second storey in the mode"),
        "shape_theta_rad_per_m": Column(theta, "rad/m", "rotation of the block in the mode; absent for the bare frame"),
    }


def _rows(beta: float, modes: Modes) -> Iterator[tuple[float, float, float, float, float, float]]:
    for i, omega in enumerate(modes.omega):
        u1, u2, *theta = (float(value) for value in modes.shapes[:, i])
        yield beta, i + 1, float(omega), u1, u2, theta[0] if theta else float("nan")
