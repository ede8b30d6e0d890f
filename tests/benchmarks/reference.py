"""Computes the reference of the benchmark anew and checks its beginning with mpmath at 30 digits.

    python tests/benchmarks/reference.py [SECONDS]

Needs heyoka and mpmath (`uv sync --dev --group benchmark`) and a processor with 80-bit arithmetic. Prints the end
state and the peaks that `bench.comparators.case` holds, how far the stored ones are off, and the greatest
difference between heyoka and mpmath after SECONDS (default 1.0, some five impacts). mpmath is given the equations
as the paper prints them: at 30 digits their cancellation does not matter.
"""

import sys
from typing import Any

import numpy as np

from bench.comparators.case import AMPLITUDE, END, IMPACTS, OMEGA, PEAKS, PHASE, SPECIMEN, START
from bench.comparators.libraries import HeyokaPeer

DIGITS = 30


def printed(mp: Any, corner: int) -> Any:
    """Eq. (8) for corner 1 (A) and Eq. (A.1) for corner -1 (B), as functions of time and state."""
    m1, m2, k1, k2, c1, c2, h1, k_c, d, b, h_b, mass, inertia, _, g, _ = (mp.mpf(float(v)) for v in SPECIMEN.packed())
    amplitude, omega_base, phase = mp.mpf(AMPLITUDE), mp.mpf(OMEGA), mp.mpf(PHASE)

    def rates(t: Any, x: Any) -> list[Any]:
        u1, u2, v1, v2, theta, omega = x
        base = amplitude * mp.sin(omega_base * t + phase)
        s, c = mp.sin(theta), mp.cos(theta)
        if corner > 0:
            squared = d**2 - 2 * (d - u1) * h1 * s - 2 * d * u1 - 2 * h1**2 * c + 2 * h1**2 + u1**2
            q = 1 - d / mp.sqrt(squared)
            pull = -k_c * (d - h1 * s - u1) * q
            spring = k_c * h1 * ((u1 - d) * c + h1 * s) * q
            angular = -(c * (b * g * mass - h_b * mass * base) - mass * s * (b * base + g * h_b) + spring) / inertia
        else:
            squared = 8 * b**2 - 4 * b * (2 * b + d) * c + u1 * (4 * b * c - 4 * b - 2 * d + u1) + 4 * b * d + d**2
            squared += 2 * h1 * (u1 - d) * s - 2 * h1**2 * (c - 1)
            q = 1 - d / mp.sqrt(squared)
            pull = k_c * (-2 * b - d + 2 * b * c + h1 * s + u1) * q
            spring = k_c * (h1 * (u1 - d) * c + (h1**2 + 2 * b * (2 * b + d - u1)) * s) * q
            angular = -(-c * (b * g * mass + h_b * mass * base) + mass * s * (b * base - g * h_b) + spring) / inertia
        first = -(pull + (c1 + c2) * v1 - c2 * v2 + (k1 + k2) * u1 - k2 * u2) / m1 - base
        second = -(c2 * (v2 - v1) + k2 * (u2 - u1)) / m2 - base
        return [v1, v2, first, second, omega, angular]

    return rates


def by_mpmath(duration: float) -> tuple[list[Any], int]:
    """State after `duration` [s] and the number of impacts, by `mpmath.odefun` and roots of its solution."""
    import mpmath as mp

    mp.mp.dps = DIGITS
    x = [mp.mpf(float(value)) for value in START.as_array()]
    now, end, corner, impacts = mp.mpf(0), mp.mpf(duration), 1, 0
    restitution = mp.mpf(SPECIMEN.block.restitution)
    while True:
        motion = mp.odefun(printed(mp, corner), now, x)
        # phases of the standard case last about 0.18 s
        left = now + mp.mpf("0.05")
        while left < end and corner * motion(left)[4] > 0:
            left += mp.mpf("0.01")
        if left >= end and corner * motion(end)[4] > 0:
            return list(motion(end)), impacts
        impact = mp.findroot(lambda t, motion=motion: motion(t)[4], (left - mp.mpf("0.01"), left), solver="anderson")
        x = list(motion(impact))
        x[4], x[5] = mp.mpf(0), x[5] * restitution
        now, corner, impacts = impact, -corner, impacts + 1


def main() -> None:
    """Print the reference and both checks."""
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    found = HeyokaPeer(1e-19, peaks=True, extended=True).run()
    peaks = np.array(found.peaks)
    print("end state:", *found.end)
    print("peaks:", *peaks)
    print(f"impacts: {found.impacts} (stored: {IMPACTS})")
    print(f"stored end state off by {float(np.abs(found.end - END).max()):.1e}")
    print(f"stored peaks off by {float(np.abs(peaks / np.array(PEAKS) - 1).max()):.1e}, relative")
    beginning = HeyokaPeer(1e-19, extended=True).run(duration)
    exact, impacts = by_mpmath(duration)
    extended = np.array([np.longdouble(str(value)) for value in exact])
    difference = float(np.abs(beginning.end - extended).max())
    print(f"heyoka and mpmath differ by {difference:.1e} after {duration:g} s")
    print(f"impacts until then: heyoka {beginning.impacts}, mpmath {impacts}")


if __name__ == "__main__":
    main()
