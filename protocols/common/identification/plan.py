"""The steps of an identification.

1. The specimen is mounted. The table is probed from a drive too small to do harm up to the level.
2. Multisines with random phases are played, each from rest; their first periods are left out.
3. Response, noise and distortion follow from the periods.
"""

from collections.abc import Generator, Sequence
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from bench.config.model import BenchConfiguration
from bench.control.identification import identify_table, line_amplitudes, line_response, sensor_agreement
from bench.control.table_model import TableModel
from bench.engine.steps import Fallen, Handle, Outcome, Played, Say, Step
from bench.events import StepStarted, TableIdentified, Warned
from drivers.rig import Handwork
from protocols.common.calibrate import Unmeasurable
from protocols.common.identification.level import Planned, mounted_name, specimen_of
from protocols.common.identification.motion import RESTING, largest
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.playing import OVERHEAD, Rules, played
from protocols.common.identification.probe import probed_response
from protocols.common.identification.signal import drive_for
from sim.specimen import Specimen

Array = NDArray[np.float64]

PROBES = 3
"""Probes that most tables take to the level: for the expected duration."""

SENSORS_AGREE = 0.05
"""Relative difference of the table's two sensors, or turn [rad] at the corner of the band, that is worth a warning."""


def expected_duration(parameters: IdentifyParameters, found: Planned) -> float:
    """Expected length of an identification [s]."""
    probes = PROBES * (found.grid.shortened().duration + OVERHEAD)
    return probes + parameters.realisations * (found.grid.duration + OVERHEAD)


def identified(
    parameters: IdentifyParameters, configuration: BenchConfiguration, found: Planned
) -> Generator[Step, Outcome, TableModel]:
    """The identification with the motions that were `found`, from the specimen on the table to the model."""
    specimen = specimen_of(parameters, configuration)
    rules = Rules(
        configuration.limits,
        found.grid.sample_rate,
        configuration.table_band[1],
        expected_duration(parameters, found),
    )
    yield _mounting(specimen)
    yield Say(StepStarted(_level(found)))
    response = yield from probed_response(found.motions[0], found.grid, rules)
    if isinstance(response, Fallen):
        raise (yield from _fell(specimen))
    each = found.grid.duration + OVERHEAD
    rules.remains(parameters.realisations * each)
    records: list[Played] = []
    for number, motion in enumerate(found.motions, 1):
        yield Say(StepStarted(f"multisine {number} of {parameters.realisations}, {found.grid.duration:.0f} s"))
        volts = found.grid.record(drive_for(motion, response, found.grid, rules.knee))
        rules.require_drive(volts)
        outcome = yield from played(volts, rules)
        if isinstance(outcome, Fallen):
            raise (yield from _fell(specimen))
        yield from _warned(outcome, specimen, configuration)
        records.append(outcome)
        rules.remains((parameters.realisations - number) * each)
        yield Say(rules.progress(f"finished multisine {number} of {parameters.realisations}"))
    model, agreement = _identified(records, found, specimen)
    yield from _told(model, agreement)
    return model


def _mounting(specimen: Specimen) -> Handle:
    if specimen.beta is None:
        return Handle(Handwork.REMOVE_BLOCK, specimen, "Take the spring and the block off the table.")
    request = f"Stand the block on its base and mount the spring of beta = {specimen.label:g}."
    return Handle(Handwork.MOUNT_SPRING, specimen, request)


def _level(found: Planned) -> str:
    reason = "as asked for" if found.binds == "level" else f"{found.binds} allows no more"
    return f"probe the table; the level is {found.level:.3g} m/s2, {reason}"


def _fell(specimen: Specimen) -> Generator[Step, Outcome, Unmeasurable]:
    """Have the block stood up; the error that ends the run."""
    if specimen.beta is None:
        return Unmeasurable("storey 1 has moved aside for good, and no block stands: see to frame and lasers")
    yield Handle(Handwork.STAND_BLOCK_UP, specimen, "The block has fallen. Stand it up again on its base.")
    return Unmeasurable("the block fell at a level that should leave it at rest: see to its base, ask for less --level")


def _warned(outcome: Played, specimen: Specimen, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """Say when the measured motion came near to lifting the block: what rocks is another system."""
    moved = outcome.signals[:, ACCELERATION]
    share = largest(moved, configuration.sample_rate, specimen, configuration).get(RESTING, 0.0)
    if share > 1.0:
        yield Say(Warned(f"the block may have lifted: the moment came to {share:.2f} of that of its weight"))


def _identified(
    records: Sequence[Played], found: Planned, specimen: Specimen
) -> tuple[TableModel, tuple[float, float]]:
    """The model, and gain and lead [s] of the displacement sensor against the accelerometer."""
    grid = found.grid
    drive = np.array([grid.used(record.drive) for record in records])
    moved = [np.array([grid.used(record.signals[:, at]) for record in records]) for at in (ACCELERATION, DISPLACEMENT)]
    date = datetime.now(UTC).replace(microsecond=0)
    model = identify_table(drive, moved[0], grid.lines, grid.sample_rate, date=date, specimen=mounted_name(specimen))
    spacing = grid.sample_rate / grid.samples
    volts = line_amplitudes(drive, grid.lines)
    each = [line_response(volts, line_amplitudes(of, grid.lines), grid.frequency, spacing) for of in moved]
    return model, sensor_agreement(*each)


def _told(model: TableModel, agreement: tuple[float, float]) -> Generator[Step, Outcome, None]:
    low, high = model.band
    text = f"{model.specimen}, {low:g} to {high:g} Hz, {len(model.frequency)} lines, {model.level:.3g} m/s2 rms"
    columns = ("frequency", "real", "imaginary", "uncertainty", "distortion", "coherence", "noise")
    yield Say(TableIdentified(text, *(np.array(getattr(model, name)) for name in columns)))
    gain, lead = agreement
    if abs(gain - 1.0) > SENSORS_AGREE or abs(2.0 * np.pi * low * lead) > SENSORS_AGREE:
        yield Say(
            Warned(
                f"table_displacement says {gain:.3f} times what table_acceleration says, {1e3 * lead:+.2f} ms apart:"
                " see to both with `rockbench check`",
            )
        )
