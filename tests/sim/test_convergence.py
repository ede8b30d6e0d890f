"""Order of convergence at fixed step length: in a smooth arc, and through impacts, where lesser schemes lose it."""

import numpy as np
import pytest

from sim.excitation import SineProgram, Sweep
from sim.kernel import rocking as kernel
from sim.rocking import State, simulate
from sim.specimen import Specimen
from tests.sim.runs import A_S, kernel_run

SPECIMEN, OMEGA = Specimen(beta=0.64), 17.0
START = np.array([0.005, -0.003, 0.02, 0.05, 0.02, -0.1])


def errors(order: int, duration: float, steps: list[int]) -> tuple[list[float], float]:
    """Greatest error of the end state for fixed steps duration / n, and the number of impacts."""
    drive = SineProgram([Sweep.dwell(duration, 1.3 * A_S, OMEGA)]).packed()
    truth, report, _ = kernel_run(SPECIMEN, drive, START, order=28, tolerance=1e-15)
    found: list[float] = []
    for n in steps:
        x, _, _ = kernel_run(SPECIMEN, drive, START, order=order, tolerance=np.inf, longest_step=duration / n)
        found.append(float(np.abs(x - truth).max()))
    return found, float(report[kernel.IMPACTS])


@pytest.mark.parametrize("order", [4, 6, 8])
def test_order_in_a_smooth_arc(order: int) -> None:
    steps = [2, 4, 8, 16] if order > 4 else [4, 8, 16, 32]
    found, impacts = errors(order, 0.08, steps)
    assert impacts == 0
    slope = -np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert slope == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize("order", [4, 6, 8])
def test_order_through_impacts(order: int) -> None:
    steps = [100, 200, 400, 800] if order == 4 else [60, 85, 120, 170, 240]
    found, impacts = errors(order, 2.0, steps)
    assert impacts >= 8
    slope = -np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert slope == pytest.approx(order, abs=0.6)


def test_error_follows_the_tolerance_over_hundreds_of_impacts() -> None:
    # on the stable orbit of beta = 0.4, omega = 16, where errors do not grow with time
    drive = SineProgram([Sweep.dwell(60.0, A_S, 16.0)], phase=3.11068)
    start = State(-0.0010828, 0.00037455, 0.049398, -0.11073, 0.0, 0.67994)
    truth = simulate(Specimen(beta=0.4), drive, state=start, tolerance=1e-14).end.as_array()
    for tolerance, allowed in ((1e-6, 3e-6), (1e-8, 3e-8), (1e-10, 3e-10)):
        motion = simulate(Specimen(beta=0.4), drive, state=start, tolerance=tolerance)
        assert motion.impacts > 300
        assert np.abs(motion.end.as_array() - truth).max() < allowed


def test_steps_stay_few() -> None:
    # three steps of order 16 between impacts 0.18 s apart: a budget in steps does not depend on the machine
    drive = SineProgram([Sweep.dwell(20.0, A_S, 17.0)])
    motion = simulate(SPECIMEN, drive, state=State(0.0, 0.0, 0.05, -0.1, 0.0, 0.7))
    assert motion.steps < 30 * 20
