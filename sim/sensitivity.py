"""Sensitivities of the gain coefficients to every parameter.

The rocking orbit is a fixed point x = F(x, p) of the return map. By the implicit function theorem,
dx/dp = (I - F_x)^-1 F_p, where F_x is the matrix whose eigenvalues are the Floquet multipliers. A peak is a stationary
value u(t*), so that its derivative is that of u at a fixed t* (envelope theorem): dP/dp = u_x dx/dp + u_p. The
derivative of alpha = P / P_bare then follows by the quotient rule. Finite differences of P itself are unsuitable: the
excursions to the two sides are so similar that a small step changes which one is larger.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import tau
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.linear import steady_peaks
from sim.return_map import STENCIL, images, jacobians, parameters, scales
from sim.rocking import State, simulate
from sim.specimen import Block, Frame, Specimen
from sim.steady import NoOrbit, Orbit, resting_state, rocking_orbit

STEP = 3e-5
"""Step of the fourth-order finite differences, relative to the parameter; absolute for a parameter that is zero."""

TOLERANCE = 1e-13
"""Integration tolerance of the runs from which finite differences are computed."""

SAMPLES, ZOOMS = 401, 2
"""Number of samples in each search for a peak, and number of successive refinements."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of alpha_1 and alpha_2 [1 / SI unit of the parameter], and the parameter's value [SI]."""

    value: float
    alpha_1: float
    alpha_2: float


class _Point(NamedTuple):
    specimen: Specimen
    omega: float
    amplitude: float


def parameter_values(specimen: Specimen, omega: float, amplitude: float) -> dict[str, float]:
    """Parameters on which a prediction depends, by name [SI]. h2 is absent because no equation contains it."""
    frame, block = specimen.frame.model_dump(exclude={"h2"}), specimen.block.model_dump()
    others = {"beta": specimen.beta or 0.0, "d": specimen.d, "g": specimen.g}
    return {**frame, **block, **others, "omega": omega, "amplitude": amplitude}


def sensitivities(
    specimen: Specimen,
    omega: float,
    amplitude: float,
    branch: Literal["rocking", "resting"] = "rocking",
    orbit: Orbit | None = None,
) -> dict[str, Sensitivity]:
    """Derivatives of alpha_1 and alpha_2 with respect to all parameters of `parameter_values`.

    `orbit` is the orbit at these parameters, if already known. The bare test also depends on the parameters, because it
    has the same frame, frequency [rad/s] and amplitude [m/s2]. beta is k_C / k1, so that a change of k1 alone also
    changes k_C. If the excursions to both sides are equal, the derivative is that of one of them.

    Raises InvalidInput as `rocking_orbit` does, and NoOrbit if the branch does not exist.
    """
    if orbit is None:
        known = rocking_orbit if branch == "rocking" else resting_state
        orbit = known(specimen, omega, amplitude)
    if orbit is None:
        raise NoOrbit(f"no resting motion at omega = {omega:g} rad/s: the block lifts; lower the amplitude")
    values = parameter_values(specimen, omega, amplitude)
    steps = {name: STEP * abs(value) or STEP for name, value in values.items()}
    nodes = STENCIL[4][0].tolist()
    moved = [_moved(specimen, values, name, node * step) for name, step in steps.items() for node in nodes]
    each = np.array(list(steps.values()))
    if orbit.branch == "rocking":
        slopes = _along_branch(orbit, moved, each)
    else:
        slopes = _slopes(np.array([_linear(point, resting=True) for point in moved]), each)
    peaks, bare = np.array([orbit.peaks.u1, orbit.peaks.drift]), _linear(_Point(specimen, omega, amplitude))
    bare_slopes = _slopes(np.array([_linear(point) for point in moved]), each)
    gains = (slopes - peaks / bare * bare_slopes) / bare
    return {
        name: Sensitivity(value, float(gain[0]), float(gain[1]))
        for (name, value), gain in zip(values.items(), gains, strict=True)
    }


def _along_branch(orbit: Orbit, moved: list[_Point], steps: Floats) -> Floats:
    """Derivatives of the peaks of u1 and drift along the branch, shape (n, 2)."""
    here, section, times = _Point(orbit.specimen, orbit.omega, orbit.amplitude), orbit.section, _peak_times(orbit)
    q = parameters(*here)
    there = np.concatenate([parameters(*point) for point in moved])
    image, _ = images(there, np.tile(section, (len(there), 1)))
    return_slopes: Floats = jacobians(q, section[None])[0]
    sections = np.linalg.solve(np.eye(6) - return_slopes, _slopes(image, steps).T)

    moves = STEP * scales(q)[0]
    starts = section + (np.diag(moves)[:, None, :] * STENCIL[4][0][:, None]).reshape(-1, 6)
    by_start = _slopes(np.array([_peaks_at(here, start, times) for start in starts]), moves)
    direct = _slopes(np.array([_peaks_at(point, section, times) for point in moved]), steps)
    total = direct + sections.T @ by_start
    return total * np.sign(_peaks_at(here, section, times))


def _peak_times(orbit: Orbit) -> Floats:
    """Times [s] at which |u1| and |u2 - u1| are greatest, shape (2,), within one period from the orbit's section."""
    found = np.empty(2)
    here = _Point(orbit.specimen, orbit.omega, orbit.amplitude)
    for which in range(2):
        middle = width = 0.5 * orbit.period
        for _ in range(ZOOMS):
            times = np.linspace(max(0.0, middle - width), middle + width, SAMPLES)
            step = float(times[1] - times[0])
            motion = _motion(here, orbit.section, times)
            at = int(np.abs(motion[1:-1, which]).argmax()) + 1
            # a maximum is flat, so that rounding blurs its time: find the zero of the velocity
            before, rate, after = motion[at - 1 : at + 2, 2 + which]
            middle = float(times[at] - np.clip(2.0 * step * rate / (after - before), -step, step))
            width = 2.0 * step
        found[which] = middle
    return found


def _peaks_at(point: _Point, section: Floats, times: Floats) -> Floats:
    """u1 at the first of `times` and u2 - u1 at the second [m], shape (2,)."""
    order = np.argsort(times)
    return _motion(point, section, times[order])[np.argsort(order), [0, 1]]


def _motion(point: _Point, section: Floats, times: Floats) -> Floats:
    """u1 and u2 - u1 [m] and their rates [m/s] at ascending `times` [s] after a section, shape (n, 4)."""
    phase, u1, u2, v1, v2, velocity = (float(value) for value in section)
    duration = float(times[-1]) + tau / point.omega
    drive = SineProgram([Sweep.dwell(duration, point.amplitude, point.omega)], phase)
    start = State(u1, u2, v1, v2, 0.0, velocity)
    samples = simulate(point.specimen, drive, state=start, sample_times=times, tolerance=TOLERANCE).samples
    if samples is None or len(samples) < len(times):
        raise NoOrbit(f"the orbit at omega = {point.omega:g} rad/s is too unstable to be differentiated")
    return np.column_stack([samples[:, 0], samples[:, 1] - samples[:, 0], samples[:, 2], samples[:, 3] - samples[:, 2]])


def _linear(point: _Point, *, resting: bool = False) -> Floats:
    peaks = steady_peaks(*point, resting=resting)
    return np.array([peaks.u1, peaks.drift])


def _slopes(values: Floats, steps: Floats) -> Floats:
    """Derivatives with respect to n parameters, shape (n, k), from values at four nodes for each, shape (4 n, k)."""
    nodes, weights = STENCIL[4]
    return np.einsum("s,nsk->nk", weights, values.reshape(steps.size, nodes.size, -1)) / steps[:, None]


def _moved(specimen: Specimen, values: dict[str, float], name: str, change: float) -> _Point:
    """Point with one parameter changed. It is not validated, because a step may take a parameter slightly below its
    limit of zero.
    """
    new = {**values, name: values[name] + change}

    def part(names: Any) -> dict[str, Any]:
        return {key: new[key] for key in names if key in new}

    frame = Frame.model_construct(None, h2=specimen.frame.h2, **part(Frame.model_fields))
    block = Block.model_construct(None, **part(Block.model_fields))
    coupled = Specimen.model_construct(None, frame=frame, block=block, **part(Specimen.model_fields))
    return _Point(coupled, new["omega"], new["amplitude"])


@dataclass(frozen=True)
class Budget:
    """First-order standard uncertainties of alpha_1 and alpha_2, and the contribution of each parameter."""

    alpha_1: float
    alpha_2: float
    contributions: dict[str, tuple[float, float]]


def budget(
    sensitivities: Mapping[str, Sensitivity],
    standard_uncertainties: Mapping[str, float],
    correlation: Mapping[tuple[str, str], float] | None = None,
) -> Budget:
    """Uncertainty of alpha_1 and alpha_2 from the standard uncertainties [SI] of parameters, by name.

    `correlation` contains the coefficients of pairs of names; other pairs are uncorrelated. Computed to first order
    (JCGM 100:2008, the GUM, Eq. 10 and 13). Raises InvalidInput for unknown names, negative uncertainties or impossible
    correlations.
    """
    names = list(standard_uncertainties)
    for name, size in standard_uncertainties.items():
        if name not in sensitivities:
            raise InvalidInput("parameter", name, f"it must be one of {', '.join(sensitivities)}")
        if not 0.0 <= size < np.inf:
            raise InvalidInput(f"standard uncertainty of {name}", size, "it must be finite and 0 or more")
    matrix = np.eye(len(names))
    for (one, other), coefficient in (correlation or {}).items():
        if one not in names or other not in names or one == other or not -1.0 <= coefficient <= 1.0:
            allowed = "it must be from -1 to 1, between two different parameters that have an uncertainty"
            raise InvalidInput(f"correlation of {one} and {other}", coefficient, allowed)
        i, j = names.index(one), names.index(other)
        matrix[i, j] = matrix[j, i] = coefficient
    if names and float(np.linalg.eigvalsh(matrix).min()) < -1e-12:
        allowed = "these correlations contradict each other: the correlation matrix has a negative eigenvalue"
        given = ", ".join(f"{one} and {other}: {value:g}" for (one, other), value in (correlation or {}).items())
        raise InvalidInput("correlation", given, allowed)
    rows = [(sensitivities[name].alpha_1, sensitivities[name].alpha_2) for name in names]
    parts = np.array(rows).reshape(-1, 2) * np.array(list(standard_uncertainties.values()))[:, None]
    alpha_1, alpha_2 = np.sqrt(np.maximum(np.einsum("ia,ij,ja->a", parts, matrix, parts), 0.0)).tolist()
    contributions = {name: (float(part[0]), float(part[1])) for name, part in zip(names, np.abs(parts), strict=True)}
    return Budget(alpha_1, alpha_2, contributions)
