"""Sines of one velocity, one frequency after the other: complex amplitudes of every signal."""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2, SIGNALS
from bench.control.legs import Leg
from bench.engine.steps import Calibrate, Dwell, Fallen, Follow, Measured, Outcome, Say, Step
from bench.events import Progress, StepStarted
from protocols.check.protocol import CheckParameters
from protocols.common.calibrate import CHANGE_TIME, SETTLING, Unmeasurable, calibrate_drive, need_cycles
from protocols.common.probe import probed_drive

_DRIVE = len(SIGNALS)
_FALLEN = "the first storey is pulled aside although no block stands on the table: check lasers and specimen"


@dataclass(frozen=True)
class Sines:
    """Complex amplitudes c at `omega` [rad/s], shape (n,) each, with signal = Re(c exp(-i omega t)).

    Four sensors see one motion and are all given as displacements [m]: acceleration over -omega^2, and the lasers as
    they see it. `drive` is in volts, `acceleration` in m/s2.
    """

    omega: NDArray[np.float64]
    drive: NDArray[np.complex128]
    acceleration: NDArray[np.complex128]
    displacement: NDArray[np.complex128]
    laser_1: NDArray[np.complex128]
    laser_2: NDArray[np.complex128]

    @property
    def accelerometer(self) -> NDArray[np.complex128]:
        """The table's displacement by the accelerometer [m]: x'' = -omega^2 x."""
        return -self.acceleration / self.omega**2


def measured_sines(parameters: CheckParameters) -> Generator[Step, Outcome, Sines]:
    """Calibrate the drive carefully, then drive and measure. Raises Unmeasurable where the signals show too little."""
    omegas = sorted(parameters.omega)
    yield Say(StepStarted("calibrate the drive"))
    # at the highest frequency the table goes least far
    probed = yield from probed_drive(omegas[-1])
    calibration = yield from calibrate_drive(omegas, parameters.velocity * omegas[0], probed)
    if isinstance(calibration, Fallen):
        raise Unmeasurable(_FALLEN)
    yield Calibrate(calibration)
    found: list[NDArray[np.complex128]] = []
    for place, omega in enumerate(omegas):
        yield Say(StepStarted(f"common motion at {omega:g} rad/s"))
        yield Say(_progress(omegas, place, parameters))
        yield Follow((Leg(CHANGE_TIME, parameters.velocity * omega, omega),))
        outcome = yield Dwell(SETTLING + parameters.cycles)
        if not isinstance(outcome, Measured):
            raise Unmeasurable(_FALLEN)
        cycles = outcome.cycles[SETTLING:]
        need_cycles(cycles, parameters.cycles)
        found.append(np.mean([cycle.fundamental for cycle in cycles], axis=0))
    yield Say(Progress(1.0, 0.0, "finished the common motion"))
    columns = np.array(found).T
    return Sines(
        omega=np.array(omegas),
        drive=columns[_DRIVE],
        acceleration=columns[ACCELERATION],
        displacement=columns[DISPLACEMENT],
        laser_1=columns[LASER_1],
        laser_2=columns[LASER_2],
    )


def _progress(omegas: list[float], place: int, parameters: CheckParameters) -> Progress:
    lengths = [CHANGE_TIME + (SETTLING + parameters.cycles) * 2.0 * np.pi / omega for omega in omegas]
    left = float(sum(lengths[place:]))
    return Progress(1.0 - left / float(sum(lengths)), left, f"common motion at {omegas[place]:g} rad/s")
