"""Delay, sign and scale between two sensors of the same motion.

A pure delay shifts the phase in proportion to the frequency, so the slope of the phase against frequency gives the
delay, whatever the motion. The phase at zero frequency determines the sign.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

_LEAST = 3
"""Minimum number of frequencies for a meaningful scatter about the line."""


@dataclass(frozen=True)
class CommonMotion:
    """The second signal is `polarity * scale` times the first, `delay` [s] later.

    `uncertainty` is the standard uncertainty of the delay [s], from the scatter of the phases about the fitted line;
    `scatter` is that scatter [rad], which is large if the two sensors did not measure the same motion. `delay` is the
    weighted mean of the delays at the frequencies, and `spread` [s] their weighted rms deviation from it.
    """

    delay: float
    uncertainty: float
    polarity: int
    scale: float
    scatter: float
    spread: float


def common_motion(
    omega: NDArray[np.float64], first: NDArray[np.complex128], second: NDArray[np.complex128]
) -> CommonMotion:
    """Compare the complex amplitudes of two signals at `omega` [rad/s], shape (m,) each.

    The frequencies, in any order, must begin near zero and be so closely spaced that the delay shifts the phase by less
    than pi between neighbours. Frequencies are weighted by the square of the first signal's amplitude. Raises
    InvalidInput for fewer than three frequencies, or if an amplitude is zero.
    """
    if omega.size < _LEAST:
        raise InvalidInput("frequencies", omega.size, f"at least {_LEAST} are required")
    if not (np.abs(first) > 0.0).all() or not (np.abs(second) > 0.0).all():
        raise InvalidInput("amplitude", 0.0, "the amplitudes of both signals must not be zero at any frequency")
    order = np.argsort(omega)
    omega, first, second = omega[order], first[order], second[order]
    weight = np.abs(first) ** 2 / np.sum(np.abs(first) ** 2)
    ratio = second / first
    fits = [(_through_origin(omega, sign * ratio, weight), sign) for sign in (1, -1)]
    (delay, variance), polarity = min(fits, key=lambda fit: fit[0][1])
    moment = float(weight @ omega**2)
    # the weights of the delays are weight * omega^2 / moment, and a delay is a phase over omega
    spread = np.sqrt(variance * (omega.size - 1) / omega.size / moment)
    return CommonMotion(
        delay=delay,
        # the weights are only relative, so the variance is estimated from the scatter
        uncertainty=float(np.sqrt(variance * (weight**2 @ omega**2)) / moment),
        polarity=polarity,
        scale=float(abs(np.sum(weight * ratio * np.exp(1j * omega * delay)))),
        scatter=float(np.sqrt(variance)),
        spread=float(spread),
    )


def _through_origin(
    omega: NDArray[np.float64], ratio: NDArray[np.complex128], weight: NDArray[np.float64]
) -> tuple[float, float]:
    """Delay [s] of the best-fitting phase line through the origin, and the variance of the phases about it [rad2]."""
    phase = np.unwrap(np.concatenate(([0.0], np.angle(ratio))))[1:]
    delay = -float(weight @ (omega * phase)) / float(weight @ omega**2)
    off = phase + omega * delay
    return delay, float(weight @ off**2) * omega.size / (omega.size - 1)
