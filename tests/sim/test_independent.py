"""Agreement with other people's integrators and other routes, to the last digits that the problem has."""

import json
from decimal import Decimal
from math import cos, fsum, hypot, sin

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.kernel import rocking as kernel
from sim.rocking import State, simulate
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from tests.sim.references import CASES, FILE, IRREGULAR, RECORD_STEP, STEADY, irregular_specimen, record, reference
from tests.sim.runs import A_S, kernel_run


@pytest.mark.parametrize(("beta", "omega"), STEADY)
def test_two_minutes_of_steady_rocking_agree_with_heyoka(beta: float, omega: float) -> None:
    # measured: at most 5e-13 (with 1e-14), 1e-12 at omega 17 and 2e-11 at omega 18 with the default tolerance of 1e-10
    specimen = Specimen(beta=beta)
    expected = reference(f"steady {beta} {omega}", specimen)
    drive = SineProgram([Sweep.dwell(120.0, A_S, omega)], phase=expected["phase"])
    for tolerance, allowed in ((1e-14, 1e-12), (1e-10, 5e-11)):
        motion = simulate(specimen, drive, state=State.from_array(np.array(expected["start"])), tolerance=tolerance)
        assert motion.impacts == expected["impacts"] > 600
        assert motion.end.as_array() == pytest.approx(expected["end"], rel=0.0, abs=allowed)


@pytest.mark.parametrize(("beta", "omega", "factor"), IRREGULAR)
def test_irregular_rocking_agrees_with_heyoka(beta: float, omega: float, factor: float) -> None:
    # measured: 2e-14 over 3 s, and as much over 10 s where the motion stays bounded
    specimen = irregular_specimen(beta)
    expected = reference(f"irregular {beta} {omega}", specimen)
    drive = SineProgram([Sweep.dwell(3.0, factor * A_S, omega)], phase=expected["phase"])
    motion = simulate(specimen, drive, state=State.from_array(np.array(expected["start"])), tolerance=1e-14)
    assert motion.impacts == expected["impacts"] >= 8
    assert motion.end.as_array() == pytest.approx(expected["end"], rel=0.0, abs=1e-12)


def test_uplift_and_impacts_agree_with_thirty_digits() -> None:
    # from rest under a sine: one uplift, five impacts; measured 8e-16
    specimen = Specimen(beta=0.64)
    exact = reference("uplift and impacts", specimen)
    motion = simulate(specimen, SineProgram([Sweep.dwell(1.2, 1.3 * A_S, 17.0)]), tolerance=1e-14)
    assert (exact["uplifts"], motion.impacts) == (1, exact["impacts"]) == (1, 5)
    assert motion.end.as_array() == pytest.approx([*map(float, exact["end"])], rel=0.0, abs=1e-14)


def test_a_record_agrees_with_thirty_digits() -> None:
    # breakpoints on every sample; measured 6e-17
    specimen = Specimen(beta=0.64)
    exact = reference("record", specimen)
    motion = simulate(specimen, SampledRecord(record(), RECORD_STEP), tolerance=1e-14)
    assert (exact["uplifts"], motion.impacts) == (1, exact["impacts"]) == (1, 2)
    assert motion.end.as_array() == pytest.approx([*map(float, exact["end"])], rel=0.0, abs=1e-14)


@pytest.mark.soak
@pytest.mark.parametrize("name", CASES)
def test_stored_references_are_what_their_integrators_compute(name: str) -> None:
    if name.startswith(("steady", "irregular")):
        pytest.importorskip("heyoka", reason="heyoka is not installed: uv sync --all-groups")
    stored, computed = json.loads(FILE.read_text(encoding="utf-8"))[name], CASES[name]()
    assert stored["impacts"] == computed["impacts"]
    # the last bits of the frame's dashpots, from an eigenvalue problem, depend on the processor, and heyoka's rounding
    # over two minutes does too
    if "uplifts" in stored:
        differences = [
            abs(Decimal(one) - Decimal(other)) for one, other in zip(stored["end"], computed["end"], strict=True)
        ]
        assert max(differences) < Decimal("1e-17")
    else:
        assert stored["end"] == pytest.approx(computed["end"], rel=0.0, abs=5e-13)


def stored_energy(specimen: Specimen, corner: float, x: NDArray[np.float64]) -> float:
    """Energy [J] from the places of the block's points, turned about its corner; nothing of `sim.kernel` is in it."""
    frame, block = specimen.frame, specimen.block
    u1, u2, v1, v2, theta, omega = (float(value) for value in x)
    turn = np.array([[cos(theta), -sin(theta)], [sin(theta), cos(theta)]])
    pivot = np.array([0.0 if corner >= 0.0 else 2.0 * block.b, 0.0])
    hook = pivot + turn @ (np.array([0.0, frame.h1]) - pivot)
    centre = pivot + turn @ (np.array([block.b, block.h_b]) - pivot)
    stretch = hypot(hook[0] + specimen.d - u1, hook[1] - frame.h1) - specimen.d
    kinetic = frame.m1 * v1**2 + frame.m2 * v2**2 + block.inertia * omega**2
    springs = frame.k1 * u1**2 + frame.k2 * (u2 - u1) ** 2 + specimen.k_c * stretch**2
    return 0.5 * (kinetic + springs) + block.mass * specimen.g * (float(centre[1]) - block.h_b)


def test_energy_balance_of_a_minute() -> None:
    # one run of 300 impacts and more; Gauss quadrature of the powers between the impacts, on the dense output of that
    # run; measured: 2e-14 of the net input work
    specimen, omega, duration = Specimen(beta=0.64), 17.0, 60.0
    frame, block, (c1, c2) = specimen.frame, specimen.block, specimen.frame.dashpots
    orbit = rocking_orbit(specimen, omega, A_S)
    drive = SineProgram([Sweep.dwell(duration, A_S, omega)], phase=orbit.phase).packed()
    # pushed off the steady motion, so that the stored energy changes too
    start = 1.1 * orbit.start.as_array()
    end, report, _ = kernel_run(specimen, drive, start, order=23, tolerance=1e-14)
    places, states = [0.0], [start]
    for number in range(1, int(report[kernel.IMPACTS]) + 1):
        after, at, _ = kernel_run(specimen, drive, start, order=23, tolerance=1e-14, impacts=number)
        places.append(float(at[kernel.END]))
        states.append(after)
    assert len(states) > 300
    nodes, weights = np.polynomial.legendre.leggauss(40)
    begin, half = np.array(places), 0.5 * np.diff([*places, duration])
    times = (begin[:, None] + half[:, None] * (nodes + 1.0)).ravel()
    _, _, samples = kernel_run(specimen, drive, start, times=times, order=23, tolerance=1e-14)
    corner = np.repeat([float(np.sign(state[5])) for state in states], nodes.size)
    assert (corner * samples[:, 4] > 0.0).all()
    _, _, v1, v2, theta, angular = samples.T
    a_g = A_S * np.sin(orbit.phase + omega * times)
    lever = block.h_b * np.cos(theta) + corner * block.b * np.sin(theta)
    piece = (half[:, None] * weights).ravel()
    put_in = fsum(piece * -a_g * (frame.m1 * v1 + frame.m2 * v2 - block.mass * lever * angular))
    damped = fsum(piece * (c1 * v1**2 + c2 * (v2 - v1) ** 2))
    r = block.restitution
    struck = fsum(0.5 * block.inertia * (state[5] / r) ** 2 * (1.0 - r * r) for state in states[1:])
    gained = stored_energy(specimen, float(corner[-1]), end) - stored_energy(specimen, 1.0, start)
    assert abs(gained) > 1e-3
    assert abs(gained - put_in + damped + struck) < 1e-12 * put_in
