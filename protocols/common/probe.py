"""The first, careful answer of the table to the drive: is there one, and how large."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.engine.steps import Calibrate, Dwell, Follow, Measured, Outcome, Step
from protocols.common.calibrate import CHANGE_TIME, PROBE, SETTLING, Unmeasurable, need_cycles

_CYCLES = 8
"""Cycles of each probe: their scatter says what is noise."""
_AUDIBLE = 5.0
"""How many standard errors the mean answer must reach: noise does so once in a hundred thousand probes."""
_DRIVE = len(SIGNALS)


def probed_drive(omega: float) -> Generator[Step, Outcome, DriveCalibration]:
    """The gain of the drive at `omega` [rad/s], from two commands too small to do harm.

    The mean over cycles is judged by the scatter of the cycles, so that noise of any colour is told from an answer.
    Raises Unmeasurable when the table does not follow.
    """
    yield Calibrate(DriveCalibration.flat(1.0))
    answer = np.zeros(0, dtype=np.complex128)
    for volts in (PROBE, 10.0 * PROBE):
        yield Follow((Leg(CHANGE_TIME, volts, omega),))
        outcome = yield Dwell(SETTLING + _CYCLES)
        cycles = outcome.cycles[SETTLING:] if isinstance(outcome, Measured) else ()
        need_cycles(cycles, _CYCLES)
        answer = np.array([cycle.fundamental[ACCELERATION] / cycle.fundamental[_DRIVE] for cycle in cycles])
    yield Follow((Leg(CHANGE_TIME, 0.0, omega),))
    gain, doubt = abs(complex(answer.mean())), _standard_error(answer)
    if not gain > _AUDIBLE * doubt:
        raise Unmeasurable(
            f"the table does not answer a drive of {10.0 * PROBE:g} V: {gain:.2g} m/s2 per volt, noise {doubt:.2g};"
            " see to the amplifier, the enable line, the emergency stop and the accelerometer"
        )
    return DriveCalibration.flat(gain)


def _standard_error(values: NDArray[np.complex128]) -> float:
    return float(np.std(values, ddof=1) / np.sqrt(values.size))
