"""What an acceleration of the table does to everything that is limited, from rest to rest, in closed form.

All of it is linear as long as a block rests: the frame then hangs on a grounded spring, and the moment about a corner,
h_b M a - k_C h1 u1, says how far the block is from lifting (Eq. 9 and A.3 of the paper).
"""

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from sim.linear import frame_matrices
from sim.specimen import Specimen

Array = NDArray[np.float64]

RESTING = "resting"
"""Key of the moment that lifts the block, over that of its weight."""

_SILENCE = 30.0
"""Rest that follows the record in the transform, so that what rings on does not come round to its begin [s]."""


def largest(
    acceleration: Array, sample_rate: float, specimen: Specimen, configuration: BenchConfiguration
) -> dict[str, float]:
    """The largest magnitude of each quantity that `bench.preflight.bounds` knows, in its unit, and of `RESTING`.

    `acceleration` [m/s2] of the table, shape (n,), begins at rest. Force and current are absent where the shaker is not
    known, `RESTING` where no block stands.
    """
    from scipy.fft import next_fast_len

    size = next_fast_len(acceleration.size + round(_SILENCE * sample_rate), real=True)
    omega: Array = 2.0 * np.pi * np.fft.rfftfreq(size, 1.0 / sample_rate).astype(np.float64)
    a = np.fft.rfft(acceleration, size)
    # a table does not drift away: no velocity and no displacement at zero frequency
    a[0], omega[0] = 0.0, 1.0
    x = -a / omega**2
    u1, u2 = _storeys(specimen, omega) * a
    ground = x if configuration.laser_reference == "ground" else 0.0 * x
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    series = {
        "displacement": x,
        "velocity": 1j * omega * x,
        "acceleration": a,
        "laser_1": (u1 + ground) / halves[0],
        "laser_2": (u2 + ground) / halves[1],
        "drift": u2 - u1,
    }
    if (mover := configuration.mover) is not None:
        series["force"] = mover.mass * a
        series["current"] = (mover.mass * a + mover.stiffness * x) / mover.force_constant
    if specimen.beta is not None:
        block = specimen.block
        moment = block.h_b * block.mass * a - specimen.k_c * specimen.frame.h1 * u1
        series[RESTING] = moment / (block.b * specimen.g * block.mass)
    made = {name: np.fft.irfft(spectrum, size)[: acceleration.size] for name, spectrum in series.items()}
    found = {name: float(np.abs(values).max()) for name, values in made.items()}
    if "current" in made:
        # the root mean square over the record: above what the guard's longer mean comes to
        found["heating"] = float(np.sqrt(np.mean(made["current"] ** 2)))
    return found


def _storeys(specimen: Specimen, omega: Array) -> NDArray[np.complex128]:
    """u1 and u2 [m] per table acceleration [m/s2] at `omega` [rad/s], shape (2, n); with a block, while it rests."""
    mass, damping, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    w = omega[:, None, None]
    dynamic = stiffness - w**2 * mass + 1j * w * damping
    push = np.broadcast_to(-np.diag(mass)[:, None], (omega.size, 2, 1))
    return np.linalg.solve(dynamic, push)[..., 0].T.astype(np.complex128)
