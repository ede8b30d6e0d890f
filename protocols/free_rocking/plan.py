"""Steps of a free-rocking run. The drive remains zero.

1. The table is locked, since a moving table absorbs part of an impact. Laser 2 is aimed at the block.
2. For each tilt, the operator holds the block and releases it during the recording; a recording without free rocking
   is repeated.
3. The tilts are combined. The laser is aimed at storey 2 again, and the table is unlocked.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.findings import (
    PUSH,
    Findings,
    LaserErrors,
    Tilt,
    analyse_tilt,
    findings,
    uncertainties,
)
from bench.analysis.free_rocking.swings import REST as STANDING
from bench.analysis.free_rocking.swings import NotRocking, Recording
from bench.analysis.signals import LASER_2
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, OperatorAction, Outcome, Play, Played, Publish, RampOut, Step
from bench.events import Event, PointFinished, Progress, StepStarted, Warned
from bench.findings import SpecimenIdentified
from drivers.rig import OperatorTask
from protocols.common.calibrate import Unmeasurable
from protocols.free_rocking.evaluation import fit_events, identified_specimen, inconsistencies, rocking_point
from protocols.free_rocking.protocol import ALL, FreeRockingParameters
from sim import block_face
from sim.errors import RockbenchError
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter, theoretical_restitution
from sim.identified import Identified
from sim.specimen import Specimen

Array = NDArray[np.float64]

STILL = 2e-3
"""Allowed scatter of the signals at rest [m], for a block held by hand."""

LOCK = "Clamp the table to the ground, so that no impact moves it. The drive stays at zero."
UNLOCK = "Remove the clamps from the table."
BACK = "Aim laser 2 at storey 2 again."

REST = 1.0
"""Time before a recording during which the operator holds the block and the signals are zeroed [s]."""

_OVERHEAD = 20.0
"""Time in which the operator tilts the block and starts the recording [s]."""

_LEAST_LOSS = 0.8
"""Smallest velocity loss per impact, relative to the theoretical loss, for which the recording is planned."""


@dataclass(frozen=True)
class PlannedTilt:
    """A planned tilt by `angle` [rad], positive towards the frame, recorded for `recording` [s]. `displacement` [m] is
    that of the block's face at the laser beam, NaN if the beam misses the face.
    """

    angle: float
    displacement: float
    recording: float

    @property
    def before(self) -> float:
        """Expected time until the recording begins [s]."""
        return _OVERHEAD + REST

    @property
    def duration(self) -> float:
        """Expected time for the complete tilt [s], if one recording suffices."""
        return self.recording + REST + _OVERHEAD


def planned_tilts(parameters: FreeRockingParameters, specimen: Specimen) -> tuple[PlannedTilt, ...]:
    """The tilts in order, smallest first; of equal tilts, the one towards the frame precedes the one away from it."""
    signs = {"both": (1.0, -1.0), "towards": (1.0,), "away": (-1.0,)}[parameters.sides]
    alpha = critical_angle(specimen.block)
    return tuple(
        _planned(parameters, specimen, sign * share * alpha) for share in sorted(parameters.tilts) for sign in signs
    )


def beam_heights(tilts: Sequence[PlannedTilt], specimen: Specimen) -> tuple[float, float]:
    """Lowest and highest height of the beam above the table [m] at which it hits the face at every tilt."""
    faces = [block_face.heights(tilt.angle, specimen.block) for tilt in tilts]
    return max(float(low) for low, _ in faces), min(float(high) for _, high in faces)


def _planned(parameters: FreeRockingParameters, specimen: Specimen, angle: float) -> PlannedTilt:
    """Plan a tilt whose recording ends after the block has come to rest, even if it is released as late as allowed."""
    block = specimen.block
    r = 1.0 - _LEAST_LOSS * (1.0 - theoretical_restitution(block))
    motion = FreeRocking(critical_angle(block), frequency_parameter(block, specimen.g), r, angle)
    return PlannedTilt(
        angle=angle,
        displacement=float(block_face.displacement(angle, parameters.height, block)),
        recording=parameters.release_within + motion.rest_time + 1.5 * STANDING,
    )


class RockingRun:
    """Steps of a run, its findings so far, and whether the table is locked and laser 2 aimed at the block."""

    def __init__(
        self, parameters: FreeRockingParameters, configuration: BenchConfiguration, tilts: Sequence[PlannedTilt]
    ) -> None:
        self._parameters, self._configuration, self._planned = parameters, configuration, tilts
        self._specimen = configuration.specimen
        self.tilts: list[Tilt] = []
        self.findings: Findings | None = None
        self.identified: Identified | None = None
        self.table_locked = False
        self.laser_on_block = False

    def steps(self) -> Generator[Step, Outcome, None]:
        """Steps of the run. Raises Unmeasurable, with the bench restored, if no tilt is usable."""
        alone = self._specimen.coupled(0.0)
        self.table_locked = True
        yield OperatorAction(OperatorTask.LOCK_TABLE, self._specimen.bare(), LOCK)
        self.laser_on_block = True
        yield OperatorAction(OperatorTask.WATCH_BLOCK, alone, self._watching, self._parameters.height)
        failed: RockbenchError | None = None
        try:
            for number, tilt in enumerate(self._planned, 1):
                yield from self._tilt(number, tilt)
            if not self.tilts:
                raise Unmeasurable("no tilt was usable: see the warnings of this run for the reasons")
            yield from self._combine()
        except RockbenchError as error:
            failed = error
        yield OperatorAction(OperatorTask.WATCH_STOREYS, alone, BACK)
        self.laser_on_block = False
        yield OperatorAction(OperatorTask.UNLOCK_TABLE, alone, UNLOCK)
        self.table_locked = False
        if failed is not None:
            raise failed

    @property
    def _watching(self) -> str:
        return (
            "Remove the spring and set the block upright on its base, without contact with other parts. Aim laser 2 at "
            f"the block's face, square to it, {1e3 * self._parameters.height:.0f} mm above the table, with the face "
            "near the middle of the laser's range."
        )

    def _tilt(self, number: int, tilt: PlannedTilt) -> Generator[Step, Outcome, None]:
        """Record a tilt until a recording is usable or the number of attempts is reached."""
        request = self._request(number, tilt)
        for attempt in range(self._parameters.attempts):
            yield Publish(StepStarted(f"tilt {number}: {degrees(tilt.angle):+.1f} degrees, block held and released"))
            again = "" if attempt == 0 else "The last recording was not usable. "
            yield OperatorAction(OperatorTask.TILT_BLOCK, self._specimen.coupled(0.0), again + request, tilt.angle)
            played = yield from self._record(number, tilt)
            try:
                found = self._analyse(played, tilt.angle)
            except NotRocking as error:
                yield Publish(Warned(f"tilt {number} is not usable: {error}"))
                continue
            self.tilts.append(found)
            yield from self._publish(found, number)
            return

    def _request(self, number: int, tilt: PlannedTilt) -> str:
        where = "towards the frame" if tilt.angle > 0.0 else "away from the frame"
        return (
            f"Tilt {number} of {len(self._planned)}: tilt the block {where} until its face has moved by about "
            f"{1e3 * abs(tilt.displacement):.0f} mm at the laser beam ({degrees(abs(tilt.angle)):.1f} degrees), "
            "and hold it still on its edge. Then confirm. Once the recording is running, count to three and release "
            "the block abruptly, without a push; then touch nothing until the block is at rest."
        )

    def _record(self, number: int, tilt: PlannedTilt) -> Generator[Step, Outcome, Played]:
        yield Arm(REST, still=STILL, patience=REST)
        volts = np.zeros(round(tilt.recording * self._configuration.sample_rate))
        outcome = yield Play(volts, self._progress(number))
        yield RampOut()
        if not isinstance(outcome, Played):
            raise TypeError(f"a recording at zero drive ended with {outcome}")
        return outcome

    def _progress(self, number: int) -> Callable[[Array], Event]:
        """Callback that computes the progress from each block of a recording."""
        total, samples = sum(tilt.duration for tilt in self._planned), 0
        begin = sum(tilt.duration for tilt in self._planned[: number - 1]) + self._planned[number - 1].before

        def progress(signals: Array) -> Event:
            nonlocal samples
            samples += len(signals)
            elapsed = min(begin + samples / self._configuration.sample_rate, total)
            return Progress(
                elapsed / total, total - elapsed, f"recording tilt {number}: release the block, then touch nothing"
            )

        return progress

    def _analyse(self, played: Played, angle: float) -> Tilt:
        p = self._parameters
        seen = Recording(played.signals[:, LASER_2], self._configuration.sample_rate, self._specimen.block, p.height)
        found = analyse_tilt(seen, self._specimen, p.least_swing * abs(angle))
        if found.swings.held * angle < 0.0:
            raise NotRocking(
                f"the laser measures a tilt of {found.swings.held:+.3f} rad, but {angle:+.3f} rad is requested: tilt "
                "the block to the other side, or check hardware.laser_2.polarity: displacements towards the frame are "
                "positive"
            )
        return found

    def _publish(self, tilt: Tilt, number: int) -> Generator[Step, Outcome, None]:
        """Publish the fits and the point of one tilt."""
        p, alone = self._parameters, self._findings([tilt])
        uncertain = uncertainties(tilt.fit, self._laser, p.height, p.height_uncertainty)
        for event in fit_events(tilt, alone, uncertain, number):
            yield Publish(event)
        remarks = ""
        if abs(tilt.push) > PUSH:
            change = f"{100.0 * tilt.push:+.0f} %"
            remarks = f"the block was not released from rest; the effect equals a change of the tilt by {change}"
            yield Publish(Warned(f"tilt {number}: {remarks}; the impacts are still used"))
        held, residual, name = tilt.swings.held, tilt.fit.rms, f"tilt {number}"
        point = rocking_point(name, alone, self._specimen, p, residual, tilt=held, push=tilt.push, remarks=remarks)
        yield Publish(PointFinished(point))

    def _combine(self) -> Generator[Step, Outcome, None]:
        """Publish the combined point of all tilts and the identified specimen."""
        self.findings = found = self._findings(self.tilts)
        residual = float(np.sqrt(np.mean([tilt.fit.rms**2 for tilt in self.tilts])))
        point = rocking_point(ALL, found, self._specimen, self._parameters, residual)
        remarks = inconsistencies(point)
        for remark in remarks:
            yield Publish(Warned(remark))
        point = point.model_copy(update={"remarks": "; ".join(remarks)})
        yield Publish(PointFinished(point))
        block, known = self._specimen.block, self._configuration.identified
        self.identified = identified_specimen(found, len(self.tilts), block, known)
        yield Publish(SpecimenIdentified(self.identified))

    def _findings(self, tilts: Sequence[Tilt]) -> Findings:
        return findings(tilts, self._laser, self._parameters.height, self._parameters.height_uncertainty)

    @property
    def _laser(self) -> LaserErrors:
        """Errors of laser 2 from the data sheet; a calibration applies only to storey displacements from rest."""
        return LaserErrors(self._configuration.sensors.accuracy, self._configuration.laser_ranges[1])
