"""The steps of free rocking. The drive stays at zero from the first to the last.

1. The table is locked: one that gives way takes part of the impact. The laser of storey 2 is turned to the block.
2. For each tilt, the operator holds the block and lets it go while it is recorded; a recording that shows no free
   rocking is repeated.
3. The tilts are combined. The laser is turned back, the table unlocked.
"""

from collections.abc import Callable, Generator, Sequence
from math import degrees

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.findings import Findings, findings, uncertainties
from bench.analysis.free_rocking.laser_errors import LaserErrors
from bench.analysis.free_rocking.swings import NotRocking, Seen
from bench.analysis.free_rocking.tilt import PUSH, Tilt, analysed
from bench.analysis.signals import LASER_2
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, Handle, Outcome, Play, Played, RampOut, Say, Step
from bench.events import Event, PointFinished, Progress, SpecimenIdentified, StepStarted, Warned
from drivers.rig import Handwork
from protocols.common.calibrate import Unmeasurable
from protocols.free_rocking.evaluation import fit_events, identified_specimen, inconsistencies, rocking_point
from protocols.free_rocking.protocol import ALL, FreeRockingParameters
from protocols.free_rocking.tilts import REST, PlannedTilt
from sim.errors import RockbenchError
from sim.identified import Identified

Array = NDArray[np.float64]

STILL = 2e-3
"""Scatter of the signals at rest [m]: a hand trembles."""

LOCK = "Clamp the table to the ground, so that no impact can move it. Nothing will be driven: leave the amplifier off."
UNLOCK = "Take the clamps off the table."
BACK = "Turn laser 2 back to storey 2."


class RockingRun:
    """One run: its steps, its findings so far, and the state of table and laser."""

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
        """The whole run. Raises Unmeasurable, with the bench as it was, when no tilt could be used."""
        alone = self._specimen.coupled(0.0)
        self.table_locked = True
        yield Handle(Handwork.LOCK_TABLE, self._specimen.bare(), LOCK)
        self.laser_on_block = True
        yield Handle(Handwork.WATCH_BLOCK, alone, self._watching, self._parameters.height)
        failed: RockbenchError | None = None
        try:
            for number, tilt in enumerate(self._planned, 1):
                yield from self._tilt(number, tilt)
            if not self.tilts:
                raise Unmeasurable("no tilt could be used: see to what the warnings say")
            yield from self._combine()
        except RockbenchError as error:
            failed = error
        yield Handle(Handwork.WATCH_STOREYS, alone, BACK)
        self.laser_on_block = False
        yield Handle(Handwork.UNLOCK_TABLE, alone, UNLOCK)
        self.table_locked = False
        if failed is not None:
            raise failed

    @property
    def _watching(self) -> str:
        return (
            "Take the spring off and stand the block alone on its base, free of everything. Let laser 2 look at its"
            f" face, square to it, {1e3 * self._parameters.height:.0f} mm above the table, near"
            " the middle of its range."
        )

    def _tilt(self, number: int, tilt: PlannedTilt) -> Generator[Step, Outcome, None]:
        """Record a tilt until a recording shows free rocking, or the attempts are used up."""
        request = self._request(number, tilt)
        for attempt in range(self._parameters.attempts):
            yield Say(StepStarted(f"tilt {number}: {degrees(tilt.angle):+.1f} degrees, block held and let go"))
            again = "" if attempt == 0 else "The last recording could not be used. "
            yield Handle(Handwork.TILT_BLOCK, self._specimen.coupled(0.0), again + request, tilt.angle)
            played = yield from self._record(number, tilt)
            try:
                found = self._analyse(played, tilt.angle)
            except NotRocking as error:
                yield Say(Warned(f"tilt {number} could not be used: {error}"))
                continue
            self.tilts.append(found)
            yield from self._publish(found, number)
            return

    def _request(self, number: int, tilt: PlannedTilt) -> str:
        where = "towards the frame" if tilt.angle > 0.0 else "away from the frame"
        return (
            f"Tilt {number} of {len(self._planned)}: tilt the block {where} until its face has moved by about"
            f" {1e3 * abs(tilt.displacement):.0f} mm where the laser meets it ({degrees(abs(tilt.angle)):.1f} degrees),"
            " and hold it still on its edge. Then answer. When the recording runs, count to three and let go at once,"
            " without a push; then touch nothing until the block stands still."
        )

    def _record(self, number: int, tilt: PlannedTilt) -> Generator[Step, Outcome, Played]:
        yield Arm(REST, still=STILL, patience=REST)
        volts = np.zeros(round(tilt.recording * self._configuration.sample_rate))
        outcome = yield Play(volts, self._progress(number))
        yield RampOut()
        if not isinstance(outcome, Played):
            raise TypeError(f"a recording without drive came to {outcome}")
        return outcome

    def _progress(self, number: int) -> Callable[[Array], Event]:
        """Makes the progress from each block of a recording."""
        total, samples = sum(tilt.duration for tilt in self._planned), 0
        begin = sum(tilt.duration for tilt in self._planned[: number - 1]) + self._planned[number - 1].before

        def progress(signals: Array) -> Event:
            nonlocal samples
            samples += len(signals)
            elapsed = min(begin + samples / self._configuration.sample_rate, total)
            return Progress(elapsed / total, total - elapsed, f"recording tilt {number}: let go, then touch nothing")

        return progress

    def _analyse(self, played: Played, angle: float) -> Tilt:
        p = self._parameters
        seen = Seen(played.signals[:, LASER_2], self._configuration.sample_rate, self._specimen.block, p.height)
        found = analysed(seen, self._specimen, p.least_swing * abs(angle))
        if found.swings.held * angle < 0.0:
            raise NotRocking(
                f"the laser shows {found.swings.held:+.3f} rad where {angle:+.3f} rad are asked for: tilt it to the"
                " other side, or see to hardware.laser_2.polarity: displacements towards the frame are positive"
            )
        return found

    def _publish(self, tilt: Tilt, number: int) -> Generator[Step, Outcome, None]:
        """The fits and the point of one tilt."""
        p, alone = self._parameters, self._findings([tilt])
        uncertain = uncertainties(tilt.fit, self._laser, p.height, p.height_uncertainty)
        for event in fit_events(tilt, alone, uncertain, number):
            yield Say(event)
        remarks = ""
        if abs(tilt.push) > PUSH:
            remarks = (
                f"not let go from rest: the motion is that of a tilt {100.0 * tilt.push:+.0f} % larger than the hand's"
            )
            yield Say(Warned(f"tilt {number}: {remarks}; the impacts count all the same"))
        held, residual, name = tilt.swings.held, tilt.fit.rms, f"tilt {number}"
        point = rocking_point(name, alone, self._specimen, p, residual, tilt=held, push=tilt.push, remarks=remarks)
        yield Say(PointFinished(point))

    def _combine(self) -> Generator[Step, Outcome, None]:
        """The point of all tilts, and the identified specimen."""
        self.findings = found = self._findings(self.tilts)
        residual = float(np.sqrt(np.mean([tilt.fit.rms**2 for tilt in self.tilts])))
        point = rocking_point(ALL, found, self._specimen, self._parameters, residual)
        remarks = inconsistencies(point)
        for remark in remarks:
            yield Say(Warned(remark))
        point = point.model_copy(update={"remarks": "; ".join(remarks)})
        yield Say(PointFinished(point))
        block, known = self._specimen.block, self._configuration.identified
        self.identified = identified_specimen(found, len(self.tilts), block, known)
        yield Say(SpecimenIdentified(self.identified))

    def _findings(self, tilts: Sequence[Tilt]) -> Findings:
        return findings(tilts, self._laser, self._parameters.height, self._parameters.height_uncertainty)

    @property
    def _laser(self) -> LaserErrors:
        """By the data sheet: a calibration applies to displacements of the storeys, from where they rest."""
        return LaserErrors(self._configuration.sensors.accuracy, self._configuration.laser_ranges[1])
