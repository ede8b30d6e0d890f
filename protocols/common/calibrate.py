"""Probe and calibration of the drive with sines, and checks of the measured cycles."""

from collections.abc import Generator, Sequence
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, mean_amplitude
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import Calibrate, Dwell, Fallen, Measured, Outcome, Step, Sweep
from protocols.common.missing import cause
from sim.errors import RockbenchError

PROBE = 0.02
"""Amplitude of the first probe of an unknown table [V]."""

CHANGE_TIME = 1.0
"""Duration of the sweep from one calibration point to the next [s]."""

SETTLING, MEASURED = 2, 4
"""Numbers of discarded and of used cycles at each point."""

ENOUGH = 0.75
"""Minimum fraction of cycles with nearly complete samples."""

AUDIBLE = 5.0
"""Smallest significant response of the table's acceleration to the drive, in standard uncertainties."""

_PROBED = 8
"""Number of cycles in each probe; the noise is estimated from their scatter."""

_DRIVE = len(SIGNALS)
"""Column of the drive in a cycle's arrays."""


def calibrate_drive(
    omegas: Sequence[float], level: float, start: DriveCalibration | None
) -> Generator[Step, Outcome, DriveCalibration | Fallen]:
    """Measure the table's response to the drive at `omegas` [rad/s] with table accelerations of `level` [m/s2].

    Without a `start`, the response is first probed with commands of 0.02 V and 0.2 V; the calibration is then extended
    by each measured frequency before the next one is measured.
    """
    known = start is not None
    if start is None:
        start = DriveCalibration.flat(1.0)
        for volts in (PROBE, 10.0 * PROBE):
            yield Calibrate(start)
            response = yield from _measure(omegas[0], volts * abs(start.response[0]))
            if isinstance(response, Fallen):
                return response
            yield Sweep((Segment(CHANGE_TIME, 0.0, omegas[0]),))
            start = DriveCalibration.flat(response)
    yield Calibrate(start)
    points: dict[float, complex] = {}
    for omega in sorted(omegas):
        response = yield from _measure(omega, level)
        if isinstance(response, Fallen):
            return response
        points[omega] = response
        if not known:
            # change the calibration at rest, so that the drive does not jump
            outcome = yield Sweep((Segment(CHANGE_TIME, 0.0, omega),))
            if isinstance(outcome, Fallen):
                return outcome
            yield Calibrate(_of(points))
    outcome = yield Sweep((Segment(CHANGE_TIME, 0.0, max(omegas)),))
    return outcome if isinstance(outcome, Fallen) else _of(points)


def probed_drive(omega: float) -> Generator[Step, Outcome, DriveCalibration]:
    """Frequency-independent calibration with the gain of the drive at `omega` [rad/s], measured with commands of 0.02 V
    and 0.2 V.

    The mean over the cycles is compared with their scatter, to separate a response from noise of any spectrum. Raises
    Unmeasurable if the table does not respond.
    """
    yield Calibrate(DriveCalibration.flat(1.0))
    answer = np.zeros(0, dtype=np.complex128)
    for volts in (PROBE, 10.0 * PROBE):
        yield Sweep((Segment(CHANGE_TIME, volts, omega),))
        outcome = yield Dwell(SETTLING + _PROBED)
        cycles = complete_cycles(outcome if isinstance(outcome, Measured) else Measured(()), _PROBED)
        answer = np.array([cycle.fundamental[ACCELERATION] / cycle.fundamental[_DRIVE] for cycle in cycles])
    yield Sweep((Segment(CHANGE_TIME, 0.0, omega),))
    gain, doubt = abs(complex(answer.mean())), _standard_error(answer)
    if not gain > AUDIBLE * doubt:
        raise Unmeasurable(
            f"the table does not respond to a drive of {10.0 * PROBE:g} V: {gain:.2g} m/s2 per volt measured, noise"
            f" {doubt:.2g} m/s2 per volt; check the amplifier, the enable line, the emergency stop and the"
            " accelerometer"
        )
    return DriveCalibration.flat(gain)


def _standard_error(values: NDArray[np.complex128]) -> float:
    return float(np.std(values, ddof=1) / np.sqrt(values.size))


def harmonic_frequencies(omega: float, highest: int) -> list[float]:
    """Frequencies [rad/s] above `omega` up to its harmonic `highest`, at most half an octave apart."""
    steps = ceil(2.0 * log2(highest))
    return [omega * highest ** (step / steps) for step in range(1, steps + 1)]


def _of(points: dict[float, complex]) -> DriveCalibration:
    return DriveCalibration(tuple(points), tuple(points.values()))


def _measure(omega: float, amplitude: float) -> Generator[Step, Outcome, complex | Fallen]:
    """Response of the table [m/s2 per V] at `omega` [rad/s]; `Fallen` if the block has fallen."""
    outcome = yield Sweep((Segment(CHANGE_TIME, amplitude, omega),))
    if isinstance(outcome, Fallen):
        return outcome
    outcome = yield Dwell(SETTLING + MEASURED)
    if not isinstance(outcome, Measured):
        return Fallen()
    used = complete_cycles(outcome, MEASURED)
    need_answer(used)
    return drive_response(used)


def drive_response(cycles: Sequence[Cycle]) -> complex:
    """Ratio of the fundamentals of table acceleration and drive over several cycles [m/s2 per V]."""
    moved, driven = (np.array([cycle.harmonics(column)[0] for cycle in cycles]) for column in (ACCELERATION, _DRIVE))
    return complex(np.vdot(driven, moved) / np.vdot(driven, driven))


STOREYS_CLAMPED = "THE STOREYS ARE STILL CLAMPED: remove the clamps before the table is driven."
"""Remark on a run that ended before the operator was asked to remove the clamps."""


class Unmeasurable(RockbenchError):
    """The signals are not sufficient to continue the protocol."""

    error_code = "not_measurable"


def complete_cycles(outcome: Measured, asked: int, settling: int = SETTLING) -> tuple[Cycle, ...]:
    """The `asked` cycles of a dwell after those of `settling`. Raises Unmeasurable if too many have missing samples."""
    cycles = outcome.cycles[settling:]
    if len(cycles) < ENOUGH * asked:
        why = "."
        if outcome.missing is not None:
            channel, count = outcome.missing
            why = f" of {channel.name}: {cause(channel, count, at_rest=False)}"
        raise Unmeasurable(f"{asked - len(cycles)} of {asked} cycles have missing samples{why}")
    return cycles


def need_answer(cycles: Sequence[Cycle]) -> None:
    """Raise Unmeasurable if the table does not respond to the drive."""
    moved = mean_amplitude(cycles, ACCELERATION)
    doubt = float(np.mean([cycle.noise[ACCELERATION] * np.sqrt(2.0 / cycle.samples) for cycle in cycles]))
    if not moved > AUDIBLE * doubt:
        raise Unmeasurable(
            f"the table does not respond to the drive: {moved:.2g} m/s2 measured, noise {doubt:.2g} m/s2;"
            " check the amplifier, the enable line and the accelerometer"
        )
