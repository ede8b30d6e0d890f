"""Motions by heyoka and by mpmath, stored in references.json: `python -m tests.sim.references` computes them again.

A reference has the parameters of the specimen, the start and the phase that it was computed for, so that it depends on
nothing of the program that a test compares with it.
"""

import argparse
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sim.specimen import Block, Specimen
from sim.steady import rocking_orbit
from tests.sim.runs import A_S

FILE = Path(__file__).with_name("references.json")
STEADY = ((0.64, 17.0), (0.40, 16.0), (0.25, 18.0), (0.97, 20.0))
"""beta and omega [rad/s] of two minutes of steady rocking."""
IRREGULAR = ((0.64, 17.0, 1.3), (0.25, 14.0, 1.1), (1.4, 19.0, 1.2))
"""beta, omega [rad/s] and amplitude relative to A_S of three seconds of irregular rocking."""
RECORD_STEP = 0.05
"""Time step of `record` [s]."""

Reference = dict[str, Any]


def irregular_specimen(beta: float) -> Specimen:
    return Specimen(beta=beta, block=Block(restitution_factor=0.992), d=0.15)


def record() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Acceleration [m/s2] that makes the block uplift once; shape (25,)."""
    return 2.2 * np.sin(14.0 * RECORD_STEP * np.arange(25)) * np.linspace(0.3, 1.0, 25)


def reference(name: str, specimen: Specimen) -> Reference:
    """The stored motion `name`. Raises AssertionError where it was computed for another specimen."""
    found: Reference = json.loads(FILE.read_text(encoding="utf-8"))[name]
    assert specimen.packed().tolist() == pytest.approx(found["parameters"], rel=1e-14), "python -m tests.sim.references"
    return found


def _heyoka(
    specimen: Specimen, amplitude: float, omega: float, phase: float, start: list[float], duration: float
) -> Reference:
    from tests.sim.oracle_heyoka import heyoka_motion

    end, impacts = heyoka_motion(specimen, amplitude, omega, phase, np.array(start), duration)
    return {"start": start, "phase": phase, "end": end.tolist(), "impacts": len(impacts)}


def _steady(beta: float, omega: float) -> Reference:
    specimen = Specimen(beta=beta)
    orbit = rocking_orbit(specimen, omega, A_S)
    start: list[float] = orbit.start.as_array().tolist()
    return _parameters(specimen) | _heyoka(specimen, A_S, omega, orbit.phase, start, 120.0)


def _irregular(beta: float, omega: float, factor: float) -> Reference:
    specimen = irregular_specimen(beta)
    start = [0.005, -0.003, 0.02, 0.05, 0.02, -0.1]
    return _parameters(specimen) | _heyoka(specimen, factor * A_S, omega, 0.3, start, 3.0)


def _uplift() -> Reference:
    """From rest under a sine of 1.3 A_S at 17 rad/s for 1.2 s; computed twice, to show that the digits hold."""
    import mpmath as mp

    from tests.sim.oracle_mpmath import DIGITS, exact_motion

    specimen = Specimen(beta=0.64)
    with mp.workdps(DIGITS):
        base = [lambda t: mp.mpf(1.3 * A_S) * mp.sin(17 * t)]
        run = partial(exact_motion, specimen, base, [mp.mpf(0), mp.mpf(1.2)], [0] * 6)
        (coarse, _, _), (end, uplifts, impacts) = run(0.06), run(0.04)
        assert max(abs(a - b) for a, b in zip(coarse, end, strict=True)) < 1e-18
        return _parameters(specimen) | _digits(end, uplifts, impacts)


def _record() -> Reference:
    """From rest under `record`, with a breakpoint at every sample."""
    import mpmath as mp

    from tests.sim.oracle_mpmath import DIGITS, Number, exact_motion

    specimen, values, dt = Specimen(beta=0.64), record().tolist(), RECORD_STEP

    def line(i: int, t: Number) -> Number:
        left, right = mp.mpf(values[i]), mp.mpf(values[i + 1])
        return left + (right - left) * (t - i * mp.mpf(dt)) / mp.mpf(dt)

    with mp.workdps(DIGITS):
        base, places = [partial(line, i) for i in range(24)], [i * mp.mpf(dt) for i in range(25)]
        return _parameters(specimen) | _digits(*exact_motion(specimen, base, places, [0] * 6, dt))


def _parameters(specimen: Specimen) -> Reference:
    return {"parameters": specimen.packed().tolist()}


def _digits(end: list[Any], uplifts: list[Any], impacts: list[Any]) -> Reference:
    import mpmath as mp

    return {"end": [mp.nstr(value, 30) for value in end], "uplifts": len(uplifts), "impacts": len(impacts)}


CASES: dict[str, Callable[[], Reference]] = {
    **{f"steady {beta} {omega}": partial(_steady, beta, omega) for beta, omega in STEADY},
    **{f"irregular {beta} {omega}": partial(_irregular, beta, omega, factor) for beta, omega, factor in IRREGULAR},
    "uplift and impacts": _uplift,
    "record": _record,
}


def main() -> None:
    argparse.ArgumentParser(prog="python -m tests.sim.references", description=__doc__).parse_args()
    made = {name: case() for name, case in CASES.items()}
    FILE.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
