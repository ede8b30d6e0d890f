"""The lab sheet of free rocking. The drive stays at zero from the first step to the last.

1. The table is locked: one that gives way takes part of the impact. The laser of storey 2 is turned to the block.
2. For each tilt, a person holds the block and lets it go while it is recorded; a recording that shows no free rocking
   is repeated.
3. The tilts are combined. The laser is turned back, the table unlocked.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
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
from protocols.free_rocking.fits import fits_of
from protocols.free_rocking.planned import planned_tilts, recording_time, seen_displacement
from protocols.free_rocking.point import doubts, point
from protocols.free_rocking.protocol import ALL, FreeRockingParameters
from sim.errors import RockbenchError
from sim.free_rocking import theoretical_restitution
from sim.identified import Finding, Identified
from sim.specimen import Block

Array = NDArray[np.float64]

REST = 1.0
"""Time at the beginning over which the zero of the signals is taken [s]: the block is in somebody's hand."""

STILL = 2e-3
"""Scatter of the signals meanwhile [m]: a hand trembles."""

OVERHEAD = 20.0
"""Time of a tilt besides its recording: a person takes the block and lets the recording begin [s]."""

LOCK = "Clamp the table to the ground, so that no impact can move it. Nothing will be driven: leave the amplifier off."
UNLOCK = "Take the clamps off the table."
BACK = "Turn laser 2 back to storey 2."


@dataclass
class Bench:
    """What the run has done to the bench by hand, and what it has found."""

    locked: bool = False
    watching: bool = False
    tilts: list[Tilt] = field(default_factory=list[Tilt])
    found: Findings | None = None
    identified: Identified | None = None


def free_rocking_plan(
    parameters: FreeRockingParameters, configuration: BenchConfiguration, bench: Bench
) -> Generator[Step, Outcome, None]:
    """The whole run as steps; `bench` is kept up to date."""
    specimen = configuration.specimen
    bench.locked = True
    yield Handle(Handwork.LOCK_TABLE, specimen.bare(), LOCK)
    bench.watching = True
    yield Handle(Handwork.WATCH_BLOCK, specimen.coupled(0.0), _watching(parameters), parameters.height)
    failed: RockbenchError | None = None
    try:
        yield from _tilts(parameters, configuration, bench)
        yield from _combined(parameters, configuration, bench)
    except RockbenchError as error:
        failed = error
    yield Handle(Handwork.WATCH_STOREYS, specimen.coupled(0.0), BACK)
    bench.watching = False
    yield Handle(Handwork.UNLOCK_TABLE, specimen.coupled(0.0), UNLOCK)
    bench.locked = False
    if failed is not None:
        raise failed


def expected_duration(parameters: FreeRockingParameters, configuration: BenchConfiguration) -> float:
    """Expected length of a run in which no recording is repeated [s]."""
    specimen = configuration.specimen
    tilts = planned_tilts(parameters, specimen)
    return sum(recording_time(parameters, specimen, tilt) + REST + OVERHEAD for tilt in tilts)


def _watching(parameters: FreeRockingParameters) -> str:
    return (
        "Take the spring off and stand the block alone on its base, free of everything. Let laser 2 look at its face,"
        f" square to it, {1e3 * parameters.height:.0f} mm above the table, near the middle of its range."
    )


def _tilting(parameters: FreeRockingParameters, configuration: BenchConfiguration, number: int, tilt: float) -> str:
    far = abs(seen_displacement(parameters, configuration.specimen, tilt))
    where = "towards the frame" if tilt > 0.0 else "away from the frame"
    count = len(planned_tilts(parameters, configuration.specimen))
    return (
        f"Tilt {number} of {count}: tilt the block {where} until its face has moved by about {1e3 * far:.0f} mm where"
        f" the laser meets it ({degrees(abs(tilt)):.1f} degrees), and hold it still on its edge. Then answer. When the"
        " recording runs, count to three and let go at once, without a push; then touch nothing until the block stands"
        " still."
    )


def _tilts(
    parameters: FreeRockingParameters, configuration: BenchConfiguration, bench: Bench
) -> Generator[Step, Outcome, None]:
    for number, tilt in enumerate(planned_tilts(parameters, configuration.specimen), 1):
        request = _tilting(parameters, configuration, number, tilt)
        for attempt in range(parameters.attempts):
            yield Say(StepStarted(f"tilt {number}: {degrees(tilt):+.1f} degrees, block held and let go"))
            again = "" if attempt == 0 else "The last recording could not be used. "
            yield Handle(Handwork.TILT_BLOCK, configuration.specimen.coupled(0.0), again + request, tilt)
            outcome = yield from _recorded(parameters, configuration, number, tilt)
            try:
                found = _analysed(outcome, parameters, configuration, tilt)
            except NotRocking as error:
                yield Say(Warned(f"tilt {number} could not be used: {error}"))
                continue
            bench.tilts.append(found)
            yield from _told(found, number, parameters, configuration)
            break
    if not bench.tilts:
        raise Unmeasurable("no tilt could be used: see to what the warnings say")


def _recorded(
    parameters: FreeRockingParameters, configuration: BenchConfiguration, number: int, tilt: float
) -> Generator[Step, Outcome, Played]:
    yield Arm(REST, still=STILL, patience=REST)
    duration = recording_time(parameters, configuration.specimen, tilt)
    volts = np.zeros(round(duration * configuration.sample_rate))
    outcome = yield Play(volts, _progress(parameters, configuration, number))
    yield RampOut()
    if not isinstance(outcome, Played):
        raise TypeError(f"a recording without drive came to {outcome}")
    return outcome


def _progress(
    parameters: FreeRockingParameters, configuration: BenchConfiguration, number: int
) -> Callable[[Array], Event]:
    total = expected_duration(parameters, configuration)
    tilts, taken = planned_tilts(parameters, configuration.specimen), 0
    gone = sum(
        recording_time(parameters, configuration.specimen, tilt) + REST + OVERHEAD for tilt in tilts[: number - 1]
    )

    def look(signals: Array) -> Event:
        nonlocal taken
        taken += len(signals)
        now = min(gone + OVERHEAD + REST + taken / configuration.sample_rate, total)
        return Progress(now / total, total - now, f"recording tilt {number}: let go, then touch nothing")

    return look


def _analysed(
    outcome: Played, parameters: FreeRockingParameters, configuration: BenchConfiguration, tilt: float
) -> Tilt:
    specimen = configuration.specimen
    seen = Seen(outcome.signals[:, LASER_2], configuration.sample_rate, specimen.block, parameters.height)
    found = analysed(seen, specimen, parameters.least_swing * abs(tilt))
    if found.swings.held * tilt < 0.0:
        raise NotRocking(
            f"the laser shows {found.swings.held:+.3f} rad where {tilt:+.3f} rad are asked for: tilt it to the other"
            " side, or see to hardware.laser_2.polarity: displacements towards the frame are positive"
        )
    return found


def _told(
    found: Tilt, number: int, parameters: FreeRockingParameters, configuration: BenchConfiguration
) -> Generator[Step, Outcome, None]:
    alone = _findings([found], parameters, configuration)
    uncertain = uncertainties(found.fit, _laser(configuration), parameters.height, parameters.height_uncertainty)
    for event in fits_of(found, alone, uncertain, number):
        yield Say(event)
    remarks = ""
    if abs(found.push) > PUSH:
        remarks = (
            f"not let go from rest: the motion is that of a tilt {100.0 * found.push:+.0f} % larger than the hand's"
        )
        yield Say(Warned(f"tilt {number}: {remarks}; the impacts count all the same"))
    held, residual = found.swings.held, found.fit.rms
    row = point(
        f"tilt {number}",
        alone,
        configuration.specimen,
        parameters,
        residual,
        tilt=held,
        push=found.push,
        remarks=remarks,
    )
    yield Say(PointFinished(row))


def _combined(
    parameters: FreeRockingParameters, configuration: BenchConfiguration, bench: Bench
) -> Generator[Step, Outcome, None]:
    bench.found = _findings(bench.tilts, parameters, configuration)
    residual = float(np.sqrt(np.mean([tilt.fit.rms**2 for tilt in bench.tilts])))
    row = point(ALL, bench.found, configuration.specimen, parameters, residual)
    found = doubts(row)
    for doubt in found:
        yield Say(Warned(doubt))
    yield Say(PointFinished(row.model_copy(update={"remarks": "; ".join(found)})))
    block, known = configuration.specimen.block, configuration.identified
    bench.identified = _identified_of(bench.found, len(bench.tilts), block, known)
    yield Say(SpecimenIdentified(bench.identified))


def _findings(tilts: Sequence[Tilt], parameters: FreeRockingParameters, configuration: BenchConfiguration) -> Findings:
    return findings(tilts, _laser(configuration), parameters.height, parameters.height_uncertainty)


def _laser(configuration: BenchConfiguration) -> LaserErrors:
    """By the data sheet: a calibration is of displacements of the storeys, from where they rest."""
    return LaserErrors(configuration.sensors.accuracy, configuration.laser_ranges[1])


def _identified_of(found: Findings, tilts: int, block: Block, known: Identified | None) -> Identified:
    """What is known of the specimen with the restitution of `block`, over that of its sides as configured.

    The factor holds with these sides only, so the finding says them, and the restitution itself.
    """
    theory, r = theoretical_restitution(block), found.restitution
    by = "sizes of the swings" if found.by_amplitudes else "exact motion"
    sides = f"2b = {2.0 * block.b:.6g} m, 2h_b = {2.0 * block.h_b:.6g} m"
    finding = Finding(
        name="restitution_factor",
        value=r.value / theory,
        standard_uncertainty=r.uncertainty / theory,
        source=f"free rocking, {tilts} tilts, by the {by}: r_exp = {r.value:.6f} of a block of {sides}",
        date=datetime.now(UTC).replace(microsecond=0),
    )
    return (known or Identified()).extended([finding])
