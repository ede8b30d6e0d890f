"""The standard case: 120 s of steady rocking with 649 impacts, with independent reference values.

START and PHASE give the periodic orbit at beta 0.64, Omega 17 rad/s to ten digits: they define the case and are taken
as exact. END and PEAKS are its solution by heyoka in 80-bit arithmetic at tolerance 1e-19, with an integrator and
equations that are independent of this program; `tests/benchmarks/reference.py` recomputes them and checks the beginning
of the motion with mpmath at 30 digits.
"""

import numpy as np
from numpy.typing import NDArray

from sim.excitation import SineProgram, Sweep
from sim.rocking import Peaks, State
from sim.specimen import Specimen

SPECIMEN = Specimen(beta=0.64)
OMEGA, AMPLITUDE, PHASE, DURATION = 17.0, 1.01 * 9.81 / 8.0, 3.106701049, 120.0
"""Circular frequency [rad/s], amplitude [m/s2], phase [rad] and duration [s] of the base's sine."""

START = State(-0.0005206767388, 0.0002474257154, 0.01109507688, -0.09173639983, 0.0, 0.6525443109)

IMPACTS = 649

END: NDArray[np.float64] = np.array(
    [
        -0.00032004601938123983152,
        0.0047147920591060567654,
        -0.0124001013518200293964,
        0.044827534742789846127,
        -0.030219691126191776354,
        -0.23633857278366831926,
    ]
)
"""State after DURATION: u1, u2 [m], their velocities [m/s], theta [rad] and its velocity [rad/s]."""

PEAKS = (0.00082052486744979255383, 0.0060632412081126333043, 0.033611621224326909147)
"""Largest |u1|, |u2 - u1| [m] and |theta| [rad] of the whole run."""


def drive(duration: float = DURATION) -> SineProgram:
    """The base excitation over `duration` [s]."""
    return SineProgram([Sweep.dwell(duration, AMPLITUDE, OMEGA)], phase=PHASE)


def error_of(end: NDArray[np.float64]) -> float:
    """Largest absolute deviation of an end state, shape (6,), from END; all components are in SI units."""
    return float(np.abs(end - END).max())


def peak_error_of(peaks: Peaks) -> float:
    """Largest relative deviation of the peaks from PEAKS."""
    found = (peaks.u1, peaks.drift, peaks.theta)
    return max(abs(value / exact - 1.0) for value, exact in zip(found, PEAKS, strict=True))
