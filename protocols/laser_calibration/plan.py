"""The steps of the laser calibration.

1. The storeys are clamped to the table, so that every sensor measures one motion.
2. The table is driven by slow sines, each pass a little smaller than the one before.
3. The clamps are taken off.
"""

from collections.abc import Callable, Generator
from datetime import UTC, datetime
from math import tau

import numpy as np

from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.signals import LASERS
from bench.config.model import BenchConfiguration
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.engine.steps import (
    Arm,
    Calibrate,
    Dwell,
    Follow,
    Handle,
    Heard,
    Listen,
    Measured,
    Outcome,
    RampOut,
    Say,
    Step,
)
from bench.events import FitFinished, FittedParameter, PointFinished, Progress, Series, StepStarted
from drivers.rig import Handwork
from protocols.common.calibrate import SETTLING, Unmeasurable, calibrate_drive, need_cycles
from protocols.common.probe import probed_drive
from protocols.laser_calibration.fit import ErrorCurve, Pass, calibration, fit_curve, mean_pass
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from protocols.laser_calibration.results import calibrated_sensors

REST = 2.0
"""Time at rest over which the lasers' readings there, and the zero of the signals, are taken [s]."""

SMALLER = 0.01
"""Share by which each pass is smaller than the first for every pass before it."""

END = 5.0
"""Expected time of the last ramp and of the computation after it [s]."""

START, CHANGE = 12.0, 3.0
"""Time in which the table goes to the first pass, and from one to the next [s]. An amplifier that makes a velocity
displaces the table by what its ramp does not make even, and only the suspension takes it back, within seconds.
"""

LEVELS = (0.2, 0.7)
"""Shares of the amplitude at which the drive is calibrated: friction takes less and less of it."""

_CLAMP = "Take spring and block off the table and clamp both storeys to it; keep clear, the amplifier is switched on."
_UNCLAMP = "Take the clamps off the storeys."
_LOOSE = "the first storey is pulled aside although no block stands on the table: check lasers and clamps"


def planned_passes(parameters: LaserCalibrationParameters) -> list[tuple[float, float]]:
    """Frequency [rad/s] and amplitude [m] of the passes: the slow ones first."""
    slow = parameters.passes // 2
    return [
        (parameters.omega * (0.5 if number < slow else 1.0), parameters.amplitude * (1.0 - SMALLER * number))
        for number in range(parameters.passes)
    ]


def expected_duration(parameters: LaserCalibrationParameters) -> float:
    """Expected length of the calibration [s]."""
    slow = 2.0 * tau / parameters.omega
    probing = 2 * (SETTLING + 8) * slow + len(LEVELS) * 2 * (6 * slow + 2.0)
    return 2.0 * REST + probing + 3.0 * START + _measuring(parameters)


def _measuring(parameters: LaserCalibrationParameters, after: int = 0) -> float:
    """Expected time of the passes but the first `after`, and of the end [s]."""
    lengths = [CHANGE + (SETTLING + parameters.cycles) * tau / omega for omega, _ in planned_passes(parameters)]
    return sum(lengths[after:]) + (END if after < len(lengths) else 0.0)


def calibration_steps(
    parameters: LaserCalibrationParameters,
    configuration: BenchConfiguration,
    keep: Callable[[LaserCalibration, tuple[ErrorCurve, ErrorCurve]], None],
) -> Generator[Step, Outcome, None]:
    """The steps of the whole calibration; `keep` is called with its results."""
    bare = configuration.known_specimen.bare()
    yield Handle(Handwork.LOCK_FRAME, bare, _CLAMP)
    yield Say(StepStarted("the lasers at rest"))
    heard = yield Listen(REST)
    if not isinstance(heard, Heard):
        raise TypeError(f"acquiring at rest came to {heard}")
    rests = _rests(heard)
    yield Arm(REST)
    try:
        passes = yield from _passes(parameters)
    except Unmeasurable:
        yield RampOut(fast=True)
        raise
    yield RampOut()
    curves = fit_curve(passes, 0, rests[0]), fit_curve(passes, 1, rests[1])
    devices = {channel.name: channel.device for channel in heard.channels}
    found = calibration(
        passes,
        curves,
        rests,
        (devices["laser_1"], devices["laser_2"]),
        configuration.analysis,
        configuration.laser_ranges,
        reference_linearity=parameters.reference_linearity,
        valid_days=parameters.valid_days,
        date=datetime.now(UTC).replace(microsecond=0),
    )
    keep(found, curves)
    for number, (curve, laser) in enumerate(zip(curves, found.lasers, strict=True), 1):
        yield Say(_fit_event(f"laser_{number}", curve, laser.delay, laser.delay_uncertainty))
    for point in calibrated_sensors(found):
        yield Say(PointFinished(point))
    yield Handle(Handwork.UNLOCK_FRAME, bare, _UNCLAMP)


def _passes(parameters: LaserCalibrationParameters) -> Generator[Step, Outcome, list[Pass]]:
    """Calibrate the drive carefully, then drive and measure. Raises Unmeasurable where the signals show too little."""
    slow = 0.5 * parameters.omega
    yield Say(StepStarted("calibrate the drive"))
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
        yield Say(StepStarted(text))
        yield Say(_progress(parameters, number - 1, text))
        if passes and passes[-1].omega == omega:
            yield Follow((Leg(CHANGE, amplitude * omega**2, omega),))
        else:
            if passes:
                yield Follow((Leg(START, 0.0, passes[-1].omega),))
            yield Follow((Leg(START, amplitude * omega**2, omega),))
        outcome = yield Dwell(SETTLING + parameters.cycles)
        if not isinstance(outcome, Measured):
            raise Unmeasurable(_LOOSE)
        cycles = outcome.cycles[SETTLING:]
        need_cycles(cycles, parameters.cycles)
        passes.append(mean_pass(cycles, omega))
    yield Say(_progress(parameters, len(passes), "finished the passes"))
    return passes


def _progress(parameters: LaserCalibrationParameters, finished: int, activity: str) -> Progress:
    """Progress by the remaining plan: before the first pass the drive has been calibrated."""
    left = _measuring(parameters, finished)
    return Progress(1.0 - left / expected_duration(parameters), left, activity)


def _rests(heard: Heard) -> tuple[float, float]:
    """Readings of both lasers at rest [m]. Raises Unmeasurable when one has nothing to read."""
    found: list[float] = []
    for name in LASERS:
        column, channel = next((k, each) for k, each in enumerate(heard.channels) if each.name == name)
        values = channel.to_unit(heard.counts[:, column])
        if not np.isfinite(values).any():
            raise Unmeasurable(f"{name} shows nothing at rest: see whether it is on and its storey is in its range")
        found.append(float(np.nanmean(values)))
    return found[0], found[1]


def _fit_event(name: str, curve: ErrorCurve, delay: float, uncertainty: float) -> FitFinished:
    at = np.linspace(curve.low, curve.high, curve.without.shape[1])
    fit = np.polynomial.chebyshev.chebval(np.linspace(-1.0, 1.0, at.size), curve.error)
    passes = {
        f"without_{number}": Series(each - each.mean(), "m", f"the same without pass {number}")
        for number, each in enumerate(curve.without, 1)
    }
    return FitFinished(
        f"error of {name}",
        f"{name}: order {curve.error.size - 1}, {1e6 * curve.uncertainty:.1f} um left open at one reading",
        {
            "reading": Series(at, "m", "reading from the middle of the range"),
            "error": Series(fit - fit.mean(), "m", "reading minus displacement as the table's sensor shows it"),
            **passes,
        },
        {"delay": FittedParameter(delay, uncertainty, "s")},
    )
