"""Demands of a table motion on table, shaker, lasers and a resting block."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.guard.shaker import Motion, ShakerModel, largest_repeated_mean
from sim.channel import STOREYS
from sim.linear import frame_matrices
from sim.specimen import Specimen

Array = NDArray[np.float64]


def table_demands(
    displacement: Motion, velocity: Motion, acceleration: Motion, shaker: ShakerModel | None
) -> dict[str, Motion]:
    """Demands on the table, including force and current if the shaker is known. Accepts samples, spectra or peaks."""
    found = {"displacement": displacement, "velocity": velocity, "acceleration": acceleration}
    if shaker is not None:
        found |= {"force": shaker.force(acceleration), "current": shaker.current(acceleration, displacement)}
    return found


def laser_demands(storey_1: Motion, storey_2: Motion, drift: Motion, halves: tuple[float, float]) -> dict[str, Motion]:
    """Displacements that the lasers of the storeys measure, relative to half their ranges, and the drift [m]."""
    return {STOREYS[0]: storey_1 / halves[0], STOREYS[1]: storey_2 / halves[1], "drift": drift}


def peaks(series: Mapping[str, Array]) -> dict[str, float]:
    """Largest magnitude of each series."""
    return {name: float(np.abs(values).max()) for name, values in series.items()}


RESTING = "resting"
"""Key for the ratio of the uplift moment to the moment of the block's weight."""

_SILENCE = 30.0
"""Time at rest [s] appended to the record before the Fourier transform, so that the free vibration does not wrap around
to the beginning.
"""


def resting_demands(
    acceleration: Array, sample_rate: float, specimen: Specimen, configuration: BenchConfiguration
) -> dict[str, float]:
    """Largest magnitude of each limited quantity, in its unit, and of `RESTING`, while the block rests.

    Computed from the frequency response: the system is linear while the block rests, because the spring is then
    grounded. The moment about a corner, h_b M a - k_C h1 u1, gives the margin to uplift (Eqs. 9 and A.3 of the paper).

    `acceleration` [m/s2] of the table, shape (n,), begins at rest. Force, current and heating are absent for an unknown
    shaker; `RESTING` is absent without a block.
    """
    from scipy.fft import next_fast_len

    size = next_fast_len(acceleration.size + round(_SILENCE * sample_rate), real=True)
    omega = _frequencies(size, sample_rate)
    a = np.fft.rfft(acceleration, size)
    # the table does not drift: no velocity and no displacement at zero frequency
    a[0] = 0.0
    x = -a / omega**2
    matrices = np.array(frame_matrices(specimen.frame))
    matrices[2, 0, 0] += specimen.k_c
    u1, u2 = _storeys(matrices.tobytes(), size, sample_rate) * a
    ground = x if configuration.laser_reference == "ground" else 0.0 * x
    series = table_demands(x, 1j * omega * x, a, configuration.shaker_model)
    series |= laser_demands(u1 + ground, u2 + ground, u2 - u1, configuration.laser_half_ranges)
    if specimen.beta is not None:
        block = specimen.block
        moment = block.h_b * block.mass * a - specimen.k_c * specimen.frame.h1 * u1
        series[RESTING] = moment / (block.b * specimen.g * block.mass)
    made = {name: np.fft.irfft(spectrum, size)[: acceleration.size] for name, spectrum in series.items()}
    found = peaks(made)
    if "current" in made:
        # other records may precede this one
        forget = float(np.exp(-1.0 / (configuration.limits.heating_time * sample_rate)))
        found["heating"] = float(np.sqrt(largest_repeated_mean(made["current"] ** 2, forget)))
    return found


def _frequencies(size: int, sample_rate: float) -> Array:
    """Circular frequencies [rad/s] of `numpy.fft.rfft`, shape (size // 2 + 1,); the first is 1 instead of zero."""
    omega: Array = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / sample_rate).astype(np.float64)
    omega[0] = 1.0
    return omega


@lru_cache(maxsize=2)
def _storeys(matrices: bytes, size: int, sample_rate: float) -> NDArray[np.complex128]:
    """u1 and u2 [m] per table acceleration [m/s2] at the `_frequencies`, shape (2, n), from the matrices of mass,
    damping and stiffness, the last with the spring to a resting block. The motions of a plan have the same frequencies.
    """
    omega = _frequencies(size, sample_rate)
    mass, damping, stiffness = np.frombuffer(matrices).reshape(3, 2, 2)
    w = omega[:, None, None]
    dynamic = stiffness - w**2 * mass + 1j * w * damping
    push = np.broadcast_to(-np.diag(mass)[:, None], (omega.size, 2, 1))
    return np.linalg.solve(dynamic, push)[..., 0].T.astype(np.complex128)
