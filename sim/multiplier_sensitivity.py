"""Sensitivities of the dominant Floquet multiplier to the parameters of specimen, drive and table.

An orbit is a solution z of G(z, p) = 0, so that dz/dp = -(dG/dz)^-1 dG/dp (implicit function theorem). Its multiplier
mu is a simple eigenvalue of the derivative J of the map over one period, with right eigenvector v and left eigenvector
w, so that d mu/dp = w (dJ/dp) v / (w v). Only the change of J v along the branch is needed: no orbit is solved again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import tau
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.knowledge import FRAME, RESTITUTION, SPRING, scaled
from sim.return_map import DIFFERENCE, images, parameters, scales
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, slowest_of
from sim.table_orbit import STEP, SUBSTEPS, TableOrbit, TablePeriod, harmonics_of

Floats = NDArray[np.float64]

OMEGA, AMPLITUDE, TABLE_MASS = "omega", "amplitude", "table_mass"

OF_SPECIMEN = (*FRAME, SPRING, RESTITUTION)
"""Parameters of the specimen. k1 and k_C are independent: k_C is the same when k1 changes."""

RELATIVE = 1e-4
"""Relative change of a parameter in the central differences along the branch. Their error is a few 1e-6 on fixed
ground and, because of the intervals of constant drive, about 1e-4 of the largest derivative on the table.
"""


@dataclass(frozen=True, eq=False)
class MultiplierSlopes:
    """Dominant multiplier at `omega` [rad/s], and the derivatives of its modulus with respect to the logarithm of each
    parameter p, d|mu|/d ln p, by name.
    """

    multiplier: complex
    omega: float
    modulus: Mapping[str, float]

    @property
    def boundary(self) -> dict[str, float]:
        """Derivatives of the frequency at which the modulus has its present value, d Omega/d ln p [rad/s], by name of
        each parameter other than the frequency.
        """
        steepness = self.modulus[OMEGA] / self.omega
        return {name: -slope / steepness for name, slope in self.modulus.items() if name != OMEGA}


class _Map(Protocol):
    """Map over one period: images of the rows of z, shape (m, n), with one parameter multiplied by `factor`."""

    def __call__(self, name: str, factor: float, z: Floats) -> Floats: ...


def fixed_slopes(orbit: Orbit) -> MultiplierSlopes:
    """Sensitivities of the dominant multiplier of a rocking orbit on fixed ground. Raises NoOrbit if the map is not
    defined around it.
    """
    return _on_fixed_ground(orbit)[0]


def _on_fixed_ground(orbit: Orbit) -> tuple[MultiplierSlopes, dict[str, Floats]]:
    """Sensitivities of the dominant multiplier and of the section."""

    def image(name: str, factor: float, z: Floats) -> Floats:
        omega, amplitude = _drive(orbit, name, factor)
        return images(parameters(_specimen(orbit, name, factor), omega, amplitude), z)[0]

    q = parameters(orbit.specimen, orbit.omega, orbit.amplitude)
    names = (*OF_SPECIMEN, AMPLITUDE, OMEGA)
    return _slopes(image, orbit.omega, orbit.section, DIFFERENCE[2] * scales(q)[0], orbit.section.size, names)


def table_slopes(orbit: TableOrbit, fixed: Orbit, shaker: Shaker) -> MultiplierSlopes:
    """Sensitivities of the dominant multiplier of `orbit` on the table of `shaker`; `fixed` is the corresponding orbit
    on fixed ground. The drive follows every parameter such that the acceleration of the table remains the requested
    sine.

    Raises NoOrbit if the block comes to rest or falls near the orbit.
    """
    states, harmonics = orbit.start.size, orbit.drive.size
    reference = TablePeriod(fixed.specimen, shaker, fixed.omega)
    phase, start, drive = _between_steps(orbit, reference)
    _, moves = _on_fixed_ground(fixed)

    def image(name: str, factor: float, z: Floats) -> Floats:
        omega, amplitude = _drive(fixed, name, factor)
        mass = shaker.moving_mass * (factor if name == TABLE_MASS else 1.0)
        period = TablePeriod(_specimen(fixed, name, factor), shaker.model_copy(update={"moving_mass": mass}), omega)
        # the start follows the first impact, which thus keeps its place between the changes of the drive
        turned = phase + (moves[name][0] * (factor - 1.0) if name in moves else 0.0)
        rows = list[Floats]()
        for row in z:
            end, samples = period.run(row[:states], row[states : states + harmonics] + 1j * row[states + harmonics :])
            error = harmonics_of(samples[:, -1], harmonics)
            error[0] += 1j * amplitude * np.exp(1j * turned)
            rows.append(np.concatenate((end, error.real, error.imag)))
        return np.array(rows)

    z = np.concatenate((start, drive.real, drive.imag))
    sizes = np.concatenate((reference.scales(start), np.full(2 * harmonics, np.abs(drive).max())))
    names = (*OF_SPECIMEN, AMPLITUDE, TABLE_MASS, OMEGA)
    return _slopes(image, fixed.omega, z, STEP * sizes, states, names)[0]


def _between_steps(orbit: TableOrbit, period: TablePeriod) -> tuple[float, Floats, NDArray[np.complex128]]:
    """Phase, start and drive of the orbit from a start less than a step later, such that no impact is near the end of a
    step: the derivative of the map jumps where an impact passes it, most at the end of a tick, where the drive changes.
    """
    _, samples = period.run(orbit.start, orbit.drive)
    theta, ticks, step = samples[:, 6], len(samples), 1.0 / SUBSTEPS
    at = np.flatnonzero(theta[1:] * theta[:-1] <= 0.0)
    impacts = np.sort(theta[at] / (theta[at] - theta[at + 1]) % step)
    gaps = np.diff(impacts, append=impacts[0] + step)
    shift = float((impacts + 0.5 * gaps)[int(np.argmax(gaps))] % step)
    start = samples[0, :8] + shift * (samples[1, :8] - samples[0, :8])
    turn = shift * tau / ticks
    drive = orbit.drive * np.exp(1j * turn * np.arange(1, orbit.drive.size + 1))
    return orbit.phase + turn, period.closed(start, drive), drive


def _slopes(
    image: _Map, omega: float, z: Floats, steps: Floats, states: int, names: Sequence[str]
) -> tuple[MultiplierSlopes, dict[str, Floats]]:
    """Slopes of the multiplier and of z, at the orbit `z`, shape (n,), whose first `states` elements are mapped to
    themselves; the images of the other elements are zero. `steps`, shape (n,), are those of the finite differences.
    """
    sides = image("", 1.0, np.concatenate((z + np.diag(steps), z - np.diag(steps))))
    if not np.isfinite(sides).all():
        raise NoOrbit(f"the orbit at omega = {omega:g} rad/s is too unstable to be differentiated")
    jacobian = ((sides[: z.size] - sides[z.size :]) / (2.0 * steps)[:, None]).T
    closing = jacobian - np.diag(np.arange(z.size) < states)
    found = np.linalg.eig(jacobian[:states, :states])
    values, vectors = found.eigenvalues.astype(np.complex128), found.eigenvectors.astype(np.complex128)
    at = int(np.argmax(np.where(values.imag >= 0.0, np.abs(values), 0.0)))
    left, v = np.linalg.inv(vectors)[at], np.zeros(z.size, dtype=np.complex128)
    v[:states] = vectors[:, at]
    size = float(1.0 / np.abs(v / steps).max())
    ahead, aside = size * v.real, size * v.imag
    sizes, moves, up, down = dict[str, float](), dict[str, Floats](), 1.0 + RELATIVE, 1.0 - RELATIVE

    def stretched(name: str, factor: float) -> NDArray[np.complex128]:
        place = z + (factor - 1.0) * moves[name]
        out = image(name, factor, place + np.array([ahead, -ahead, aside, -aside]))[:, :states]
        return (out[0] - out[1] + 1j * (out[2] - out[3])) / (2.0 * size)

    for name in names:
        change = (image(name, up, z[None])[0] - image(name, down, z[None])[0]) / (up - down)
        moves[name] = -np.linalg.solve(closing, change)
        moved = left @ (stretched(name, up) - stretched(name, down)) / (up - down)
        sizes[name] = float((np.conj(values[at]) * moved).real / abs(values[at]))
    return MultiplierSlopes(slowest_of(values), omega, sizes), moves


def _specimen(orbit: Orbit, name: str, factor: float) -> Specimen:
    return scaled(orbit.specimen, {name: factor}) if name in OF_SPECIMEN else orbit.specimen


def _drive(orbit: Orbit, name: str, factor: float) -> tuple[float, float]:
    """Frequency [rad/s] and amplitude [m/s2], one of them multiplied by `factor` if it is the parameter `name`."""
    return (
        orbit.omega * (factor if name == OMEGA else 1.0),
        orbit.amplitude * (factor if name == AMPLITUDE else 1.0),
    )
