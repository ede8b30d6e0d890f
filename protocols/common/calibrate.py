"""Calibration of the drive by sines that leave the block at rest, and the evidence that measured cycles must show."""

from collections.abc import Generator, Sequence
from math import ceil, log2

import numpy as np

from bench.analysis.cycles import Cycle, mean_amplitude
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.engine.steps import Calibrate, Dwell, Fallen, Follow, Measured, Outcome, Step
from sim.errors import RockbenchError

PROBE = 0.02
"""First, careful amplitude [V] when nothing is known of the drive yet."""

CHANGE_TIME = 1.0
"""Time in which frequency and level go from one calibration point to the next [s]."""

SETTLING, MEASURED = 2, 4
"""Cycles that are left out and used at each point."""

ENOUGH = 0.75
"""Share of the asked cycles that must have come with nearly all their samples."""

AUDIBLE = 5.0
"""How many standard deviations of its fit the table's acceleration must reach to count as an answer to the drive."""

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


class Unmeasurable(RockbenchError):
    """The signals do not show what the protocol needs to go on."""

    error_code = "not_measurable"


def need_cycles(cycles: Sequence[Cycle], asked: int) -> None:
    """Raise Unmeasurable when too many cycles lack samples."""
    if len(cycles) < ENOUGH * asked:
        raise Unmeasurable(
            f"{asked - len(cycles)} of {asked} cycles lack samples: a sensor leaves its range; move it or ask for less"
        )


def need_answer(cycles: Sequence[Cycle]) -> None:
    """Raise Unmeasurable when the table does not follow the drive."""
    moved = mean_amplitude(cycles, ACCELERATION)
    doubt = float(np.mean([cycle.noise[ACCELERATION] * np.sqrt(2.0 / cycle.samples) for cycle in cycles]))
    if not moved > AUDIBLE * doubt:
        raise Unmeasurable(
            f"the table does not answer the drive: {moved:.2g} m/s2 measured, noise {doubt:.2g} m/s2;"
            " check the amplifier, the enable line and the accelerometer"
        )
