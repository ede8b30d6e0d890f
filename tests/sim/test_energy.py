"""The energy balance: what the base puts in is stored, damped away, or lost in impacts."""

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.excitation import SineProgram, Sweep
from sim.kernel import rocking as kernel
from sim.kernel.equations import energy
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from tests.sim.runs import A_S, kernel_run


def power(specimen: Specimen, corner: float, x: NDArray[np.float64], a_g: NDArray[np.float64]) -> NDArray[np.float64]:
    """Power [W] of the base's inertia forces less that of the dashpots, shape (n,): what changes `energy`."""
    frame, block, (c1, c2) = specimen.frame, specimen.block, specimen.frame.dashpots
    _, _, v1, v2, theta, omega = x.T
    lever = block.h_b * np.cos(theta) + corner * block.b * np.sin(theta)
    inertia_forces = -a_g * (frame.m1 * v1 + frame.m2 * v2 - block.mass * lever * omega)
    return inertia_forces - c1 * v1**2 - c2 * (v2 - v1) ** 2


def still(duration: float) -> NDArray[np.float64]:
    """A base that does not move."""
    return np.array([[duration, *[0.0] * 9]])


@pytest.mark.parametrize("beta", [0.0, 0.25, 0.97])
def test_energy_balance_over_many_impacts(beta: float) -> None:
    specimen, omega, amplitude = Specimen(beta=beta), 17.0, A_S
    orbit = rocking_orbit(specimen, omega, amplitude)
    # pushed off the steady motion, so that the stored energy changes too
    packed, x = specimen.packed(), orbit.start.as_array() * 1.1
    nodes, weights = np.polynomial.legendre.leggauss(40)
    begin, energy_0, scale, work, lost = 0.0, energy(packed, 1.0, x), 0.0, 0.0, 0.0
    corner = 1.0
    for _ in range(60):
        drive = SineProgram([Sweep.dwell(3.0, amplitude, omega)], phase=orbit.phase + omega * begin).packed()
        after, report, _ = kernel_run(specimen, drive, x, impacts=1)
        assert report[kernel.STATUS] == kernel.IMPACT_LIMIT
        flight = float(report[kernel.END])
        times = 0.5 * flight * (nodes + 1.0)
        _, _, samples = kernel_run(specimen, drive, x, times=times, impacts=1)
        flow = power(specimen, corner, samples, amplitude * np.sin(orbit.phase + omega * (begin + times)))
        work += 0.5 * flight * float(weights @ flow)
        scale += 0.5 * flight * float(weights @ np.abs(flow))
        r = specimen.block.restitution
        lost += 0.5 * specimen.block.inertia * (after[5] / r) ** 2 * (1.0 - r * r)
        x, begin, corner = after, begin + flight, -corner
    residual = energy(packed, corner, x) - energy_0 - work + lost
    assert lost > 0.01
    assert abs(residual) < 1e-11 * scale


def test_energy_is_conserved_without_damping_or_impacts() -> None:
    specimen = Specimen(beta=0.64)
    packed = specimen.packed()
    packed[4:6] = 0.0  # no dashpots
    x, report = np.array([0.01, 0.0, 0.0, 0.1, 0.1, 0.0]), np.empty(kernel.REPORT)
    before = energy(packed, 1.0, x)
    segments, nothing = still(0.2), np.empty(0)
    kernel.run(packed, segments, x, nothing, np.empty((0, 6)), 20, 1e-13, np.inf, 1.5, 0.0, 0.0, 9, report)
    assert report[kernel.IMPACTS] == 0
    assert energy(packed, 1.0, x) == pytest.approx(before, rel=1e-13)


def test_free_motion_loses_energy_at_every_look() -> None:
    specimen, times = Specimen(beta=0.4), np.linspace(0.0, 6.0, 400)
    _, _, samples = kernel_run(specimen, still(6.0), np.array([0.02, 0.0, 0.0, 0.0, 0.06, 0.0]), times=times)
    packed = specimen.packed()
    stored = np.array([energy(packed, float(np.sign(x[4])), np.ascontiguousarray(x)) for x in samples])
    assert (np.diff(stored) <= 1e-14).all()
    assert stored[-1] < 0.5 * stored[0]
