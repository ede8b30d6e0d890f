"""Free rocking of the stand-alone block on fixed ground, in closed form, after release from a tilt.

Between impacts theta'' = -p^2 sin(alpha - theta) for theta > 0, and mirrored for theta < 0. With phi = alpha - |theta|
this is phi'' = p^2 sin(phi), a pendulum near its upper equilibrium. From the turning point of a half swing, where
phi = phi_m,

    phi(t) = 2 acos(k cd(p t | k^2)),    k = cos(phi_m / 2),

with Jacobi's elliptic function cd. The ground is reached after a quarter of the period, Q = F(psi | k^2) / p,

    tan(psi) = sqrt(sin(alpha - theta_m / 2) sin(theta_m / 2)) / (cos(alpha / 2) sin(phi_m / 2)),

which is K(k^2) - F(asin(cos(alpha / 2) / k) | k^2) without its cancellation. An impact multiplies the angular velocity
by r, and hence the energy above the ground, cos(alpha - |theta_n|) - cos(alpha) at the n-th turning point, by r^2.
Source: Housner (1963), with the exact equation of motion; Abramowitz and Stegun 16 and 17.
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan2, ceil, cos, hypot, log, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.specimen import Block

Array = NDArray[np.float64]

_SMALLEST = 1e-8
"""Energy, relative to that at overturning, below which the block counts as at rest: a tilt of about 1e-9 rad."""

_MOST = 2000
"""Maximum number of impacts that are computed."""


def critical_angle(block: Block) -> float:
    """alpha = atan(b / h_b) [rad], the tilt beyond which the block overturns."""
    return atan2(block.b, block.h_b)


def frequency_parameter(block: Block, g: float) -> float:
    """p = sqrt(M g R / J) [rad/s], where R is the distance from a corner to the block's centre, and `g` is in m/s2."""
    return sqrt(block.mass * g * hypot(block.b, block.h_b) / block.inertia)


def theoretical_restitution(block: Block) -> float:
    """r = 1 - 2 M b^2 / J of an inelastic impact that conserves the angular momentum about the new corner.

    Source: Housner (1963).
    """
    return 1.0 - 2.0 * block.mass * block.b**2 / block.inertia


def energy(angle: Array, alpha: float) -> Array:
    """Potential energy at `angle` [rad] relative to that at alpha, any shape.

    (cos(alpha - |theta|) - cos(alpha)) / (1 - cos(alpha)), computed from products of sines, because the difference of
    cosines would suffer from cancellation near the ground.
    """
    half = 0.5 * np.abs(angle)
    return np.asarray(np.sin(alpha - half) * np.sin(half) / np.sin(0.5 * alpha) ** 2)


@dataclass(frozen=True)
class FreeRocking:
    """Free motion of a block with critical angle `alpha` [rad] and frequency parameter `p` [rad/s], 0 < |tilt| < alpha.

    The block rests at `tilt` [rad] until `start` [s]. An impact multiplies the angular velocity by
    `restitution` + `trend` (s - `trend_at`), where s, 0 to 1, is the speed of the impact relative to that after a fall
    from alpha.
    """

    alpha: float
    p: float
    restitution: float
    tilt: float
    start: float = 0.0
    trend: float = 0.0
    trend_at: float = 0.0

    @cached_property
    def energies(self) -> Array:
        """`energy` at the turning points, starting with the release, shape (n,)."""
        first = float(energy(np.array(self.tilt), self.alpha))
        if self.trend == 0.0:
            impacts = log(_SMALLEST / first) / (2.0 * log(self.restitution)) if self.restitution > 0.0 else 1.0
            number = np.arange(min(max(ceil(impacts), 0) + 1, _MOST), dtype=np.float64)
            return np.asarray(first * self.restitution ** (2.0 * number), dtype=np.float64)
        found = [first]
        while found[-1] > _SMALLEST and len(found) < _MOST:
            r = self.restitution + self.trend * (sqrt(found[-1]) - self.trend_at)
            found.append(found[-1] * r * r)
        return np.array(found)

    @cached_property
    def amplitudes(self) -> Array:
        """|theta_n| [rad] at the turning points, same shape as `energies`."""
        # cos(alpha - theta) = cos(alpha) + energy (1 - cos(alpha)) in half angles, for the same reason as in `energy`
        phi = 2.0 * np.arcsin(sin(0.5 * self.alpha) * np.sqrt(1.0 - self.energies))
        return np.asarray(self.alpha - phi)

    @cached_property
    def quarters(self) -> Array:
        """Time [s] from the ground to each turning point, equal to the time back; same shape as `energies`."""
        from scipy import special

        phi, half = self.alpha - self.amplitudes, 0.5 * self.amplitudes
        height = np.sqrt(np.sin(self.alpha - half) * np.sin(half))
        psi = np.arctan2(height, cos(0.5 * self.alpha) * np.sin(0.5 * phi))
        return np.asarray(special.ellipkinc(psi, np.cos(0.5 * phi) ** 2) / self.p)

    @cached_property
    def impacts(self) -> Array:
        """Instants of the impacts [s], one after each turning point, same shape as `energies`."""
        between = self.quarters.copy()
        between[1:] += self.quarters[1:]
        return self.start + np.cumsum(between)

    @cached_property
    def turns(self) -> Array:
        """Instants of the turning points [s], starting with the release, same shape as `energies`."""
        return self.impacts - self.quarters

    @property
    def sides(self) -> Array:
        """Sign of theta at the turning points, same shape as `energies`."""
        return np.copysign(1.0, self.tilt) * (-1.0) ** np.arange(self.energies.size)

    def angle(self, times: Array) -> Array:
        """theta [rad] at ascending `times` [s], shape (n,)."""
        from scipy import special

        swing = np.searchsorted(self.impacts, times)
        moving = swing < self.impacts.size
        at = np.minimum(swing, self.impacts.size - 1)
        k = np.cos(0.5 * (self.alpha - self.amplitudes))[at]
        since = np.where(times < self.start, 0.0, times - self.turns[at])
        ellipj: Any = special.ellipj
        _, cn, dn, _ = ellipj(self.p * since, k * k)
        return np.asarray(moving * self.sides[at] * (self.alpha - 2.0 * np.arccos(k * cn / dn)))

    def acceleration(self, angle: Array) -> Array:
        """theta'' [rad/s2] of the rocking block at `angle` [rad], any shape."""
        return np.asarray(-np.sign(angle) * self.p**2 * np.sin(self.alpha - np.abs(angle)))

    @property
    def rest_time(self) -> float:
        """Instant [s] at which the block comes to rest; the smallest of the infinitely many impacts are neglected."""
        return float(self.impacts[-1])
