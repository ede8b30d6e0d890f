"""What acceleration the drive makes: measured at each frequency, at a level that leaves the block at rest."""

from collections.abc import Generator, Sequence
from math import ceil, log2

import numpy as np

from bench.analysis.cycles import Cycle
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.engine.steps import Calibrate, Dwell, Fallen, Follow, Measured, Outcome, Step
from protocols.harmonic.evidence import need_answer, need_cycles

PROBE = 0.02
"""First, careful amplitude [V] when nothing is known of the drive yet."""

CHANGE_TIME = 1.0
"""Time in which frequency and level go from one calibration point to the next [s]."""

SETTLING, MEASURED = 2, 4
"""Cycles that are left out and used at each point."""

_DRIVE = len(SIGNALS)
"""Column of the drive in a cycle's arrays."""


def calibrate_drive(
    omegas: Sequence[float], level: float, start: DriveCalibration | None
) -> Generator[Step, Outcome, DriveCalibration | Fallen]:
    """Measure the table's response to the drive at `omegas` [rad/s] with table accelerations of `level` [m/s2].

    Without a `start` the response is first probed in two steps, from a command too small to do harm, and what was
    measured at one frequency serves as the start for the next.
    """
    known = start is not None
    if start is None:
        start = DriveCalibration.flat(1.0)
        for volts in (PROBE, 10.0 * PROBE):
            yield Calibrate(start)
            response = yield from _measure(omegas[0], volts * abs(start.response[0]))
            if isinstance(response, Fallen):
                return response
            yield Follow((Leg(CHANGE_TIME, 0.0, omegas[0]),))
            start = DriveCalibration.flat(response)
    yield Calibrate(start)
    points: dict[float, complex] = {}
    for omega in sorted(omegas):
        response = yield from _measure(omega, level)
        if isinstance(response, Fallen):
            return response
        points[omega] = response
        if not known:
            # at rest, or the drive would jump
            outcome = yield Follow((Leg(CHANGE_TIME, 0.0, omega),))
            if isinstance(outcome, Fallen):
                return outcome
            yield Calibrate(_of(points))
    outcome = yield Follow((Leg(CHANGE_TIME, 0.0, max(omegas)),))
    return outcome if isinstance(outcome, Fallen) else _of(points)


def harmonic_frequencies(omega: float, highest: int) -> list[float]:
    """Frequencies [rad/s] from `omega` up to its harmonic `highest`, `omega` itself left out, half an octave apart."""
    steps = ceil(2.0 * log2(highest))
    return [omega * highest ** (step / steps) for step in range(1, steps + 1)]


def _of(points: dict[float, complex]) -> DriveCalibration:
    return DriveCalibration(tuple(points), tuple(points.values()))


def _measure(omega: float, amplitude: float) -> Generator[Step, Outcome, complex | Fallen]:
    """Response [m/s2 per V] at one frequency."""
    outcome = yield Follow((Leg(CHANGE_TIME, amplitude, omega),))
    if isinstance(outcome, Fallen):
        return outcome
    outcome = yield Dwell(SETTLING + MEASURED)
    if not isinstance(outcome, Measured):
        return Fallen()
    used = outcome.cycles[SETTLING:]
    need_cycles(used, MEASURED)
    need_answer(used)
    return drive_response(used)


def drive_response(cycles: Sequence[Cycle]) -> complex:
    """Fundamental of the table's acceleration over that of the drive, over cycles [m/s2 per V]."""
    moved, driven = (np.array([cycle.harmonics(column)[0] for cycle in cycles]) for column in (ACCELERATION, _DRIVE))
    return complex(np.vdot(driven, moved) / np.vdot(driven, driven))
