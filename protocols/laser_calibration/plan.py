"""Passes of the laser calibration: slow sines of the table, each slightly smaller than the previous one."""

from collections.abc import Generator
from datetime import UTC, datetime
from math import tau

import numpy as np

from bench.analysis.laser_calibration import LaserCalibration
from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import (
    AcquireAtRest,
    Arm,
    Calibrate,
    Dwell,
    Measured,
    Outcome,
    Publish,
    RampOut,
    RestSamples,
    Step,
    Sweep,
)
from bench.events import Progress, StepStarted
from protocols.common.calibrate import SETTLING, Unmeasurable, calibrate_drive, complete_cycles, probed_drive
from protocols.laser_calibration.curves import HARMONICS, ErrorCurve, Pass, mean_pass
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from protocols.laser_calibration.reference import ReferenceCurve
from protocols.laser_calibration.scales import calibrate
from sim.channel import STOREYS

REST = 2.0
"""Time at rest in which the lasers are read and the signals are zeroed [s]."""

SMALLER = 0.01
"""Reduction of the amplitude from pass to pass, relative to the first amplitude."""

END = 5.0
"""Expected duration of the last ramp and of the computation [s]."""

START, CHANGE = 12.0, 3.0
"""Duration of a sweep from or to rest, and between passes of the same frequency [s].

If the amplifier controls velocity, an asymmetric ramp leaves the table displaced, and the suspension returns it within
seconds.
"""

LEVELS = (0.2, 0.7)
"""Levels of the drive calibration relative to the amplitude; friction has less effect at the higher level."""

_LOOSE = "storey 1 has a permanent offset although no block is on the table: check lasers and clamps"


def planned_passes(parameters: LaserCalibrationParameters) -> list[tuple[float, float]]:
    """Frequencies [rad/s] and amplitudes [m] of the passes, the slow ones first."""
    slow = parameters.passes // 2
    return [
        (parameters.omega * (0.5 if number < slow else 1.0), parameters.amplitude * (1.0 - SMALLER * number))
        for number in range(parameters.passes)
    ]


def expected_duration(parameters: LaserCalibrationParameters) -> float:
    """Expected duration of the calibration [s]."""
    slow = 2.0 * tau / parameters.omega
    probing = 2 * (SETTLING + 8) * slow + len(LEVELS) * 2 * (6 * slow + 2.0)
    return 2.0 * REST + probing + 3.0 * START + _measuring(parameters)


def _measuring(parameters: LaserCalibrationParameters, after: int = 0) -> float:
    """Expected duration of the passes after number `after`, including the last ramp and the computation [s]."""
    lengths = [CHANGE + (SETTLING + parameters.cycles) * tau / omega for omega, _ in planned_passes(parameters)]
    return sum(lengths[after:]) + (END if after < len(lengths) else 0.0)


def measure(
    parameters: LaserCalibrationParameters, configuration: BenchConfiguration
) -> Generator[Step, Outcome, tuple[LaserCalibration, tuple[ErrorCurve, ErrorCurve], ReferenceCurve]]:
    """Steps of the measurement with the clamped frame; returns the calibration, the error curves of the lasers and that
    of the table's displacement sensor.
    """
    yield Publish(StepStarted("acquire the laser signals at rest"))
    at_rest = yield AcquireAtRest(REST)
    if not isinstance(at_rest, RestSamples):
        raise TypeError(f"the acquisition at rest ended with {at_rest}")
    rests = _rest_readings(at_rest)
    yield Arm(REST)
    try:
        passes = yield from _passes(parameters)
    except Unmeasurable:
        yield RampOut(fast=True)
        raise
    yield RampOut()
    devices = {channel.name: channel.device for channel in at_rest.channels}
    return calibrate(
        passes,
        rests,
        (devices[STOREYS[0]], devices[STOREYS[1]]),
        configuration.analysis,
        configuration.laser_ranges,
        reference_linearity=parameters.reference_linearity,
        valid_days=parameters.valid_days,
        date=datetime.now(UTC).replace(microsecond=0),
    )


def _passes(parameters: LaserCalibrationParameters) -> Generator[Step, Outcome, list[Pass]]:
    """Calibrate the drive at increasing levels, then drive the table and measure. Raises Unmeasurable if the response
    is insufficient.
    """
    slow = 0.5 * parameters.omega
    yield Publish(StepStarted("calibrate the drive"))
    known: DriveCalibration = yield from probed_drive(slow)
    for share in LEVELS:
        measured = yield from calibrate_drive([slow, parameters.omega], share * parameters.amplitude * slow**2, known)
        if not isinstance(measured, DriveCalibration):
            raise Unmeasurable(_LOOSE)
        known = measured
        yield Calibrate(known)
    passes: list[Pass] = []
    for number, (omega, amplitude) in enumerate(planned_passes(parameters), 1):
        text = f"pass {number} of {parameters.passes}: {1e3 * amplitude:.1f} mm at {omega:g} rad/s"
        yield Publish(StepStarted(text))
        yield Publish(_progress(parameters, number - 1, text))
        if passes and passes[-1].omega == omega:
            yield Sweep((Segment(CHANGE, amplitude * omega**2, omega),))
        else:
            if passes:
                yield Sweep((Segment(START, 0.0, passes[-1].omega),))
            yield Sweep((Segment(START, amplitude * omega**2, omega),))
        outcome = yield Dwell(SETTLING + parameters.cycles, harmonics=HARMONICS)
        if not isinstance(outcome, Measured):
            raise Unmeasurable(_LOOSE)
        passes.append(mean_pass(complete_cycles(outcome, parameters.cycles), omega))
    yield Publish(_progress(parameters, len(passes), "passes finished"))
    return passes


def _progress(parameters: LaserCalibrationParameters, finished: int, activity: str) -> Progress:
    """Progress after `finished` passes, from the expected duration of the remaining ones."""
    left = _measuring(parameters, finished)
    return Progress(1.0 - left / expected_duration(parameters), left, activity)


def _rest_readings(samples: RestSamples) -> tuple[float, float]:
    """Readings of both lasers at rest [m]. Raises Unmeasurable if a laser has no valid reading."""
    found: list[float] = []
    for name in STOREYS:
        column, channel = next((k, each) for k, each in enumerate(samples.channels) if each.name == name)
        values = channel.to_unit(samples.counts[:, column])
        if not np.isfinite(values).any():
            raise Unmeasurable(
                f"{name} has no valid reading at rest: check that it is on and that its storey is within its range"
            )
        found.append(float(np.nanmean(values)))
    return found[0], found[1]
