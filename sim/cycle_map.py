"""Linear map from cycle to cycle near a steady rocking motion, with the fundamental of the drive as its input.

Cycle n lasts from one Poincaré section to the next. At its beginning, the state deviates from the orbit by x_n, shape
(8,). In its first part, the control changes smoothly from c_(n-1) to c_n. A control is a complex number relative to the
amplitude of the table's acceleration, written as a vector of its real and imaginary parts. With y_n, the Fourier
coefficients of u1 and drift over the cycle,

    x_(n+1) = M x_n + B1 c_(n-1) + B0 c_n
    y_n     = y* + C x_n + D1 c_(n-1) + D0 c_n.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.shaker import Shaker
from sim.steady import Orbit
from sim.table_orbit import TICKS, TablePeriod, table_orbit

Array = NDArray[np.float64]

OBSERVED = 3
"""Number of harmonics of u1, and of the drift, in the vector y."""

STEP = 1e-4
"""Step of the finite differences: of states relative to their scales, and of the control relative to the amplitude."""

RIGID = Shaker(moving_mass=1e8, friction=0.0, voltage_limit=1e12, current_limit=1e12)
"""Shaker with a table so heavy that the block does not move it."""

TABLE = 2
"""Number of states of the table, which come first. They are omitted for a rigid table, because its free motion would
hardly decay.
"""


@dataclass(frozen=True, eq=False)
class CycleMap:
    """Map from cycle to cycle at `omega` [rad/s]; cycles begin at `phase` [rad] of the base's sine.

    States are relative to their scales on the orbit. Shapes: `transition` M (n, n), `inputs` B1, B0 (n, 2), `outputs` C
    (12, n), `feedthrough` D1, D0 (12, 2), `orbit` y* (12,) [m]; n is 8, or 6 on a rigid table. `blend` is the fraction
    of a cycle in which the control changes. The elements of y are ordered as by the function `coefficients`.
    """

    omega: float
    phase: float
    blend: float
    transition: Array
    inputs: tuple[Array, Array]
    outputs: Array
    feedthrough: tuple[Array, Array]
    orbit: Array

    @property
    def slowest(self) -> complex:
        """Multiplier with the greatest modulus; of a conjugate pair, the one in the upper half plane."""
        multipliers = np.linalg.eigvals(self.transition)
        found = complex(multipliers[int(np.argmax(np.abs(multipliers)))])
        return complex(found.real, abs(found.imag))

    @property
    def sensitive(self) -> complex:
        """Control of unit magnitude, in a single cycle, that most excites the dominant pair of multipliers."""
        multipliers, vectors = np.linalg.eig(self.transition)
        at = int(np.argmax(np.abs(multipliers)))
        before, now = self.inputs
        effect = np.linalg.inv(vectors)[at] @ (multipliers[at] * now + before)
        _, _, directions = np.linalg.svd(np.stack((effect.real, effect.imag)))
        return complex(directions[0, 0], directions[0, 1])

    def excitation(self, cycles: int) -> tuple[NDArray[np.complex128], float]:
        """Controls of successive cycles, shape (cycles,), after which the state deviates along the dominant pair only.

        The largest control has the magnitude 1. Also returns the relative deviation of y that these controls cause. The
        phase of the deviation is chosen for the smallest controls.
        """
        multipliers, vectors = np.linalg.eig(self.transition)
        pair = vectors[:, int(np.argmax(np.abs(multipliers)))]
        plane: Array = np.stack((np.real(pair), np.imag(pair)), axis=1)
        before, now = self.inputs
        effects = list[Array]()
        power = np.eye(self.transition.shape[0])
        for _ in range(cycles):
            # the cycle after the controls still contains the change back to zero
            effects.append(power @ (self.transition @ now + before))
            power = power @ self.transition
        controls = np.linalg.pinv(np.hstack(effects[::-1])) @ plane
        _, _, directions = np.linalg.svd(controls)
        found: Array = (controls @ directions[-1]).reshape(-1, 2)
        largest = float(np.hypot(found[:, 0], found[:, 1]).max())
        deviation = float(np.linalg.norm(self.outputs @ plane @ directions[-1]) / np.linalg.norm(self.orbit))
        return (found[:, 0] + 1j * found[:, 1]) / largest, deviation / largest


def coefficients(u1: NDArray[np.complex128], drift: NDArray[np.complex128]) -> Array:
    """Return the vector y, shape (12,), for complex harmonics of u1 and drift [m], each of shape (OBSERVED,) or longer.

    A signal is the imaginary part of the sum of z_k exp(i k phi), with phi the phase of the base's sine.
    """
    both = np.concatenate((u1[:OBSERVED], drift[:OBSERVED]))
    return np.concatenate((both.real, both.imag))


def cycle_map(fixed: Orbit, shaker: Shaker | None, harmonics: int, blend: float = 0.5) -> CycleMap:
    """Compute the map near the orbit `fixed` on the table of `shaker`, controlled up to harmonic number `harmonics`.

    Without a `shaker`, the table is rigid. The control changes along a smoothstep in the first fraction `blend` of a
    cycle. Raises NoOrbit as `sim.table_orbit.table_orbit` does.
    """
    table = RIGID if shaker is None else shaker
    orbit = table_orbit(fixed, table, harmonics)
    period = TablePeriod(fixed.specimen, table, fixed.omega)
    middle = (np.arange(TICKS) + 0.5) / TICKS
    done = np.minimum(middle / blend, 1.0)
    done *= done * (3.0 - 2.0 * done)
    volts = table.gain * fixed.amplitude / complex(table.frequency_response(fixed.omega, fixed.specimen.mass))
    # a control c gives the table the additional acceleration Im(A c exp(i phi))
    carrier = -1j * volts * np.exp(1j * (orbit.phase + 2.0 * np.pi * middle))
    orders = np.arange(1, OBSERVED + 1)
    angles = np.arange(TICKS) * (2.0 * np.pi / TICKS)
    fourier = 2j / TICKS * np.exp(-1j * np.outer(orders, orbit.phase + angles))
    sizes = period.scales(orbit.start)

    def response(state: Array, before: complex, now: complex) -> Array:
        """State after the cycle, relative to its scales, and coefficients y of the cycle."""
        changes = (before * carrier).real, ((before + (now - before) * done) * carrier).real
        after, samples = period.run(orbit.start + state * sizes, orbit.drive, changes)
        u1, drift = samples[:, 2], samples[:, 3] - samples[:, 2]
        return np.concatenate((after / sizes, coefficients(fourier @ u1, fourier @ drift)))

    def slope(state: Array, before: complex, now: complex) -> Array:
        return (response(state, before, now) - response(-state, -before, -now)) / (2.0 * STEP)

    rest, n = np.zeros(sizes.size), sizes.size
    states = np.stack([slope(STEP * unit, 0.0, 0.0) for unit in np.eye(n)], axis=1)
    before = np.stack([slope(rest, STEP * unit, 0.0) for unit in (1.0, 1j)], axis=1)
    now = np.stack([slope(rest, 0.0, STEP * unit) for unit in (1.0, 1j)], axis=1)
    first = TABLE if shaker is None else 0
    return CycleMap(
        omega=fixed.omega,
        phase=orbit.phase,
        blend=blend,
        transition=states[first:n, first:],
        inputs=(before[first:n], now[first:n]),
        outputs=states[n:, first:],
        feedthrough=(before[n:], now[n:]),
        orbit=response(rest, 0.0, 0.0)[n:],
    )
