"""Stages of a sine test before its starts and after its dwells: calibrations of the drive, and end of the test."""

from collections.abc import Generator, Sequence

import numpy as np

from bench.control.oscillator import DriveCalibration
from bench.control.starts import Start
from bench.engine.steps import Arm, Calibrate, Fallen, OperatorAction, Outcome, Publish, RampOut, Step
from bench.events import StepStarted
from drivers.rig import OperatorTask, RigError
from protocols.common.calibrate import calibrate_drive, harmonic_frequencies
from protocols.common.sine.settings import SineParameters
from sim.specimen import Specimen
from sim.steady import resting_level

REST = 2.0
"""Time at rest before a test, during which the signals are zeroed [s]."""

NO_BLOCK = "storey 1 has a permanent offset although the block was removed: check lasers and specimen"

FALLEN_REQUEST = "The block has fallen: set it upright again."


def bare_calibration(
    parameters: SineParameters, omegas: Sequence[float], amplitude: float, bare: Specimen
) -> Generator[Step, Outcome, DriveCalibration]:
    """Calibrate the drive of the `bare` frame at `omegas` [rad/s], and from the highest of them up to its harmonic
    `parameters.harmonics`, for tests at `amplitude` [m/s2].

    The table remains armed with this calibration. Raises RigError if a fall of the block is detected.
    """
    yield OperatorAction(OperatorTask.REMOVE_BLOCK, bare, "Remove the spring and the block from the table.")
    yield Arm(REST)
    yield Publish(StepStarted("calibrate the drive, bare frame"))
    level = parameters.calibration_level * amplitude
    above = harmonic_frequencies(max(omegas), parameters.harmonics)
    calibration = yield from calibrate_drive((*omegas, *above), level, None)
    if isinstance(calibration, Fallen):
        raise RigError(NO_BLOCK)
    yield Calibrate(calibration)
    return calibration


def spring_calibration(
    specimen: Specimen, omegas: Sequence[float], starts: Sequence[Start], level: float, bare: DriveCalibration
) -> Generator[Step, Outcome, DriveCalibration]:
    """Calibrate the drive of the coupled frame, with the block at rest, at `omegas` [rad/s] and on a grid over the
    frequencies of the `starts`, with table accelerations of at most `level` [m/s2], and end the test.

    Above the highest of these frequencies, where the block mainly adds mass, the response of the `bare` frame is used.
    It is used at all frequencies if the block falls during the calibration.
    """
    request = f"Set the block upright on its base and mount the spring of beta = {specimen.label:g}."
    yield OperatorAction(OperatorTask.MOUNT_SPRING, specimen, request)
    yield Arm(REST)
    yield Publish(StepStarted(f"calibrate the drive, beta = {specimen.label:g}"))
    wanted, allowed = resting_calibration(specimen, omegas, starts, level)
    measured = yield from calibrate_drive(wanted, allowed, bare)
    yield from end_test(specimen, fast=isinstance(measured, Fallen))
    return measured.beyond(bare) if isinstance(measured, DriveCalibration) else bare


def resting_calibration(
    specimen: Specimen, omegas: Sequence[float], starts: Sequence[Start], level: float
) -> tuple[list[float], float]:
    """Frequencies [rad/s] and level [m/s2] of the drive calibration with a spring. The level leaves the block at rest
    and does not exceed `level`.
    """
    swept = sorted({segment.omega for start in starts for segment in start.segments})
    grid = np.linspace(swept[0], swept[-1], max(round((swept[-1] - swept[0]) / 1.5) + 1, 2))
    wanted = sorted({*(round(float(omega), 2) for omega in grid), *omegas})
    return wanted, min(level, 0.6 * min(resting_level(specimen, omega) for omega in wanted))


def end_test(specimen: Specimen, *, fast: bool) -> Generator[Step, Outcome, None]:
    """Ramp out, quickly if `fast`, which means that the block has fallen; then request that a fallen block be set
    upright.
    """
    outcome = yield RampOut(fast=fast)
    if fast or isinstance(outcome, Fallen):
        yield OperatorAction(OperatorTask.STAND_BLOCK_UP, specimen, FALLEN_REQUEST)
