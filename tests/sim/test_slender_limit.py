"""Formulas of the linear slender block: the limit that the nonlinear block tends to as alpha = atan(b / h_b) vanishes.

The overturning thresholds of pulses and the symmetric steady motion are exact only there. So their deviation must
fall with the square of alpha, and its extrapolation to alpha = 0 must be the formula.
"""

from math import asin, atan2, cosh, exp, hypot, pi, sin, sinh, sqrt, tan

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, root

from sim.excitation import SineProgram, Sweep
from sim.kernel import rocking as kernel
from sim.rocking import Status, simulate
from sim.specimen import Block, Specimen
from tests.sim.runs import kernel_run


def slender(alpha: float, r: float | None = None) -> tuple[Specimen, float]:
    """A block of a stated alpha, of restitution `r` when given, and its p [rad/s]."""
    plain = Block(b=0.2 * tan(alpha))
    block = plain if r is None else Block(b=plain.b, restitution_factor=r / plain.restitution)
    specimen = Specimen(beta=0.0, block=block)
    return specimen, sqrt(block.mass * specimen.g * hypot(block.b, block.h_b) / block.inertia)


def in_the_limit(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Richardson's limit of values at alpha, alpha/2, alpha/4, ... whose error is even in alpha."""
    order = 2
    while len(values) > 1:
        values = (2**order * values[1:] - values[:-1]) / (2**order - 1)
        order += 2
    return values[0]


def threshold(frequency: float, halves: int) -> float:
    """A / (alpha g) of a pulse of one or two half-sines that only just overturns the slender block without impact.

    From the stable manifold w = theta' + p (theta - alpha), w' = p w + p^2 a_g / g, w = -p alpha at uplift:
    sqrt(A^2 - 1) + A exp(-(pi - psi) / O) = O for a half-sine, sqrt(A^2 - 1) - A exp(-(2 pi - psi) / O) = O for a
    full one, with O = omega / p and psi = asin(1 / A).
    """
    sign, end = (1.0, pi) if halves == 1 else (-1.0, 2.0 * pi)

    def excess(a: float) -> float:
        return sqrt(a * a - 1.0) + sign * a * exp(-(end - asin(1.0 / a)) / frequency) - frequency

    return float(brentq(excess, 1.0 + 1e-9, 50.0, xtol=1e-15))


@pytest.mark.parametrize(
    ("frequency", "halves", "printed"),
    [
        (2.0, 1, 1.8007239306),
        (3.0, 1, 2.2938723134),
        (5.0, 1, 3.2891467775),
        (8.0, 1, 4.7870712683),
        (2.0, 2, 2.3499031270),
        (3.0, 2, 3.6311498724),
        (5.0, 2, 7.1681287971),
    ],
)
def test_overturning_threshold_of_a_pulse_in_the_slender_limit(frequency: float, halves: int, printed: float) -> None:
    # measured: order 2.000 and 9e-16 in the limit
    expected = threshold(frequency, halves)
    assert expected == pytest.approx(printed, abs=1e-10)
    found: list[float] = []
    for alpha in (0.04, 0.02, 0.01, 0.005):
        specimen, p = slender(alpha)

        def pulse(a: float, specimen: Specimen = specimen, alpha: float = alpha, p: float = p) -> SineProgram:
            dwell = Sweep.dwell(halves * pi / (frequency * p), a * alpha * specimen.g, frequency * p)
            return SineProgram([dwell, Sweep.dwell(40.0 / p, 0.0, 1.0)])

        def excess(a: float, specimen: Specimen = specimen, alpha: float = alpha, p: float = p) -> float:
            """Distance from the stable manifold of the nonlinear block, w = theta' - 2 p sin((alpha - theta) / 2)."""
            short = SineProgram(pulse(a).sweeps[:1])
            motion = simulate(specimen, short, tolerance=1e-14)
            assert motion.impacts == 0
            return motion.end.omega / (p * alpha) - 2.0 * sin(0.5 * (alpha - motion.end.theta)) / alpha

        a = float(brentq(excess, 0.9 * expected, 1.1 * expected, xtol=1e-15, rtol=1e-14))
        found.append(a / expected)
        # and it is the outcome of a run, not only of a formula
        assert simulate(specimen, pulse(a * (1.0 + 1e-6)), tolerance=1e-13).status is Status.OVERTURNED_A
        assert simulate(specimen, pulse(a * (1.0 - 1e-6)), tolerance=1e-13).impacts > 0
    errors = np.array(found) - 1.0
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=1e-3)
    assert in_the_limit(np.array(found)) == pytest.approx(1.0, abs=1e-12)


def symmetric_motion(a: float, frequency: float, r: float) -> tuple[float, float, float]:
    """Phase at the impact, velocity after it / (p alpha), and peak / alpha of steady slender rocking.

    y'' = y - 1 + A sin(O t + psi) over half a period, from y = 0 and v to y = 0 and -v / r (Spanos and Koh, 1984).
    """
    half, b = pi / frequency, a / (1.0 + frequency**2)
    ch, sh = cosh(half), sinh(half)

    def second(s: float) -> float:
        return -(1.0 + s + (s - 1.0) * ch) / sh

    def slope(s: float) -> float:
        """B O cos psi that the jump of the velocity asks for, affine in s = B sin psi."""
        return ((s - 1.0) * sh + second(s) * (ch + 1.0 / r)) / (1.0 / r - 1.0)

    q_0 = slope(0.0)
    q_1 = slope(1.0) - q_0
    for s in np.roots([1.0 + (q_1 / frequency) ** 2, 2.0 * q_0 * q_1 / frequency**2, (q_0 / frequency) ** 2 - b**2]):
        s, q = float(s), q_0 + q_1 * float(s)
        psi, c_1, c_2 = atan2(s * frequency, q), s - 1.0, second(s)

        def angle(t: float | NDArray[np.float64], psi: float = psi, c_1: float = c_1, c_2: float = c_2):
            return 1.0 + c_1 * np.cosh(t) + c_2 * np.sinh(t) - b * np.sin(frequency * t + psi)

        times = np.linspace(0.0, half, 2001)
        if c_2 - q > 0.0 and (angle(times[1:-1]) > 0.0).all():

            def rate(t: float, psi: float = psi, c_1: float = c_1, c_2: float = c_2) -> float:
                return c_1 * sinh(t) + c_2 * cosh(t) - b * frequency * float(np.cos(frequency * t + psi))

            top = int(angle(times).argmax())
            return psi % (2.0 * pi), c_2 - q, float(angle(brentq(rate, times[top - 1], times[top + 1], xtol=1e-16)))
    raise AssertionError("no symmetric motion")


@pytest.mark.parametrize(
    ("a", "frequency", "r", "printed"),
    [
        (3.0, 5.0, 0.9, (3.019614, 0.83070247, 0.16201436)),
        (5.0, 8.0, 0.925, (3.062238, 0.77585889, 0.09567995)),
        (1.5, 4.0, 0.85, (2.893253, 0.65776062, 0.15820791)),
    ],
)
def test_symmetric_steady_rocking_in_the_slender_limit(
    a: float, frequency: float, r: float, printed: tuple[float, float, float]
) -> None:
    # measured: order 2.000 and 3e-15 in the limit, of phase, velocity and peak
    expected = np.array(symmetric_motion(a, frequency, r))
    assert expected == pytest.approx(printed, abs=6e-7)
    found: list[NDArray[np.float64]] = []
    for alpha in (0.04, 0.02, 0.01, 0.005):
        specimen, p = slender(alpha, r)
        peak = np.nan

        def closure(x: NDArray[np.float64], specimen: Specimen = specimen, alpha: float = alpha, p: float = p):
            """Half a period after an impact comes the mirror image of that impact; x = phase, velocity, scaled."""
            nonlocal peak
            dwell = Sweep.dwell(2.0 * pi / (frequency * p), a * alpha * specimen.g, frequency * p)
            start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, x[1] * alpha * p])
            drive = SineProgram([dwell], phase=x[0]).packed()
            after, report, _ = kernel_run(specimen, drive, start, impacts=1, order=24, tolerance=1e-15)
            peak = report[kernel.PEAKS + 2] / alpha
            return [report[kernel.END] * p * frequency / pi - 1.0, after[5] / (alpha * p) + x[1]]

        x = root(closure, expected[:2], options={"xtol": 1e-14}).x
        assert np.abs(closure(x)).max() < 1e-13
        found.append(np.array([*x, peak]) / expected)
    errors = np.array(found) - 1.0
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(np.full((3, 3), 2.0), abs=2e-3)
    assert in_the_limit(np.array(found)) == pytest.approx(np.ones(3), abs=1e-12)
