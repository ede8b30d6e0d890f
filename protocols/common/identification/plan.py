"""Steps of an identification.

1. The specimen is mounted. The table is probed with increasing drive, from a peak of 0.02 V up to the level of the
   multisines.
2. Multisines with random phases are played, each from rest; their first periods are discarded.
3. Response, noise and distortion are computed from the periods.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT
from bench.config.model import BenchConfiguration
from bench.control.identification import identify_table, line_amplitudes, line_response, sensor_agreement, waveform
from bench.control.table_model import TableModel
from bench.engine.steps import Arm, Fallen, OperatorAction, Outcome, Play, Played, Publish, RampOut, Step
from bench.events import Event, Progress, StepStarted, Warned
from bench.findings import TableIdentified
from bench.guard.limits import Limits
from bench.guard.quantities import filled
from bench.preflight.motion import RESTING, resting_demands
from drivers.rig import OperatorTask
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.signal import (
    Complex,
    Grid,
    Planned,
    drive_for,
    measured_peak,
    mounted_name,
    specimen_of,
)
from sim.specimen import Specimen

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each drive, during which the signals are zeroed [s]."""

OVERHEAD = 12.0
"""Time required in addition to the duration of the drive [s]: rest, settling of the storeys, and ramp."""


@dataclass
class Rules:
    """Limits and progress of all drives of one identification; `knee` [Hz] is the upper end of the table's band.

    `expected` [s] is the total duration, of which `gone` [s] have been played.
    """

    limits: Limits
    sample_rate: float
    knee: float
    expected: float
    gone: float = 0.0

    def require_drive(self, volts: Array) -> None:
        """Raise Unmeasurable for a drive beyond its limits, which occurs if the table responds less than expected."""
        peak, slew = float(np.abs(volts).max()), float(np.abs(np.diff(volts)).max()) * self.sample_rate
        limits = self.limits
        if peak > limits.drive_voltage or slew > limits.drive_slew:
            raise Unmeasurable(
                f"the motion would need {peak:.3g} V and {slew:.3g} V/s of drive, but limits.drive_voltage = "
                f"{limits.drive_voltage:g} V and limits.drive_slew = {limits.drive_slew:g} V/s: reduce --level, or "
                "use a narrower band"
            )

    def progress(self, activity: str) -> Progress:
        return Progress(self.gone / self.expected, self.expected - self.gone, activity)

    def remains(self, seconds: float) -> None:
        """Correct the expected remaining time [s], since the number of probes depends on the table."""
        self.expected = self.gone + seconds

    def watch(self) -> Callable[[Array], Event]:
        """Callback that computes the progress from each block of signals."""
        since = 0

        def progress(signals: Array) -> Event:
            nonlocal since
            since += len(signals)
            gone = min(self.gone + since / self.sample_rate, self.expected)
            return Progress(gone / self.expected, self.expected - gone, "playing the multisine")

        return progress


def played(volts: Array, rules: Rules) -> Generator[Step, Outcome, Played | Fallen]:
    """Arm, play and ramp out. Returns `Fallen` if the block falls, even during the ramp."""
    yield Arm(REST)
    outcome = yield Play(volts, rules.watch())
    end = yield RampOut(fast=isinstance(outcome, Fallen))
    rules.gone += volts.size / rules.sample_rate + OVERHEAD
    if isinstance(outcome, Played) and not isinstance(end, Fallen):
        return outcome
    return Fallen()


GROWTH = 10.0
"""Largest growth factor of the table's motion between probes."""

REACHED = 0.95
"""Fraction of the final motion above which a probe is the last."""

AUDIBLE = 2.0
"""Minimum ratio of the response to its noise."""

_AUDIBLE_BY = 2
"""Number of probes within which the table must respond."""

_MOST = 6
"""Largest number of probes."""


def probed_response(motion: Complex, grid: Grid, rules: Rules) -> Generator[Step, Outcome, Complex | Fallen]:
    """Response of the table [m/s2/V] at the lines, shape (n_lines,), measured with increasing drive up to the
    acceleration spectrum `motion` [m/s2]; `Fallen` if the block falls.

    Raises Unmeasurable if the table does not respond, or does not reach this motion.
    """
    short = grid.shortened()
    level, reached = measured_peak(motion, short, rules.knee), 0.0
    # the first drive has the spectrum of the acceleration, since the response is unknown
    drive = motion * (PROBE / _peak(motion, short))
    for probe in range(1, _MOST + 1):
        rules.require_drive(short.record(drive))
        yield Publish(StepStarted(f"probe {probe}: {_peak(drive, short):.3g} V"))
        outcome = yield from _complete(short.record(drive), rules, short, f"probe {probe}")
        if isinstance(outcome, Fallen):
            return outcome
        volts, moved = (line_amplitudes(short.used(of), short.lines) for of in (outcome.drive, _acceleration(outcome)))
        answer, noise = _answer(moved)
        if not answer > AUDIBLE * noise:
            if probe >= _AUDIBLE_BY:
                raise Unmeasurable(
                    f"the table does not respond to a drive of {_peak(drive, short):.2g} V: {answer:.2g} m/s2, noise"
                    f" {noise:.2g} m/s2; check the amplifier, the enable line, the emergency stop and the accelerometer"
                )
            drive = GROWTH * drive
            continue
        response = moved.mean(axis=0) / volts.mean(axis=0)
        reached = measured_peak(moved.mean(axis=0), short, rules.knee)
        if reached >= REACHED * level:
            return response
        drive = drive_for(motion, response, short, rules.knee) * min(1.0, GROWTH * reached / level)
    raise Unmeasurable(
        f"after {_MOST} probes the acceleration of the table is {reached:.2g} m/s2, but {level:.2g} m/s2 "
        "is required: check the amplifier's gain and the guides of the table"
    )


def _acceleration(outcome: Played) -> NDArray[np.float64]:
    return outcome.signals[:, ACCELERATION]


def _answer(moved: Complex) -> tuple[float, float]:
    """Response and its noise [m/s2], from the amplitudes `moved`, shape (periods, n_lines).

    The response is the root sum of squares, over the lines, of the mean amplitudes of the periods; the noise is the
    root sum of squares of the standard errors of these means, estimated from the scatter between periods. If the table
    does not respond, the two differ only randomly, and their relative difference decreases with the number of lines.
    """
    periods, mean = moved.shape[0], moved.mean(axis=0)
    noise = np.sum(np.abs(moved - mean) ** 2) / (periods * (periods - 1))
    return float(np.sqrt(np.sum(np.abs(mean) ** 2))), float(np.sqrt(noise))


def _peak(spectrum: Complex, grid: Grid) -> float:
    return float(np.abs(waveform(grid.lines, spectrum, grid.samples)).max())


Array = NDArray[np.float64]

PROBES = 3
"""Typical number of probes, used for the expected duration."""

SENSORS_AGREE = 0.05
"""Relative difference of the table's two sensors, or phase difference [rad] at the lower end of the band, above which a
warning is issued.
"""


def expected_duration(parameters: IdentifyParameters, found: Planned) -> float:
    """Expected duration of an identification [s]."""
    probes = PROBES * (found.grid.shortened().duration + OVERHEAD)
    return probes + parameters.realisations * (found.grid.duration + OVERHEAD)


def identified(
    parameters: IdentifyParameters, configuration: BenchConfiguration, found: Planned
) -> Generator[Step, Outcome, TableModel]:
    """All steps of an identification with the planned motions `found`, from mounting the specimen to the table
    model.
    """
    specimen = specimen_of(parameters, configuration)
    rules = Rules(
        configuration.limits,
        found.grid.sample_rate,
        configuration.table_band[1],
        expected_duration(parameters, found),
    )
    yield _mounting(specimen)
    yield Publish(StepStarted(_level(found)))
    response = yield from probed_response(found.motions[0], found.grid, rules)
    if isinstance(response, Fallen):
        raise (yield from _fell(specimen))
    each = found.grid.duration + OVERHEAD
    rules.remains(parameters.realisations * each)
    records: list[Played] = []
    for number, motion in enumerate(found.motions, 1):
        yield Publish(StepStarted(f"multisine {number} of {parameters.realisations}, {found.grid.duration:.0f} s"))
        volts = found.grid.record(drive_for(motion, response, found.grid, rules.knee))
        rules.require_drive(volts)
        outcome = yield from _complete(volts, rules, found.grid, f"multisine {number}")
        if isinstance(outcome, Fallen):
            raise (yield from _fell(specimen))
        yield from _warned(outcome, specimen, configuration)
        records.append(outcome)
        rules.remains((parameters.realisations - number) * each)
        yield Publish(rules.progress(f"multisine {number} of {parameters.realisations} finished"))
    model, agreement = _identified(records, found, specimen)
    yield from _publish_model(model, agreement)
    return model


def _complete(volts: Array, rules: Rules, grid: Grid, name: str) -> Generator[Step, Outcome, Played | Fallen]:
    """Play a multisine without missing samples of the table's motion in the periods that are used; it is repeated once.
    Raises Unmeasurable if they are missing again.
    """
    for again in (False, True):
        outcome = yield from played(volts, rules)
        if isinstance(outcome, Fallen):
            return outcome
        moved = outcome.signals[:, [ACCELERATION, DISPLACEMENT]]
        lost = int(np.count_nonzero(~np.isfinite(grid.used_rows(moved)).all(axis=1)))
        if not lost:
            return outcome
        if not again:
            rules.remains(rules.expected - rules.gone + volts.size / rules.sample_rate + OVERHEAD)
            yield Publish(Warned(f"{name}: samples of the table's motion are missing ({lost}); it is repeated"))
    raise Unmeasurable(
        f"{name}: samples of the table's motion are missing in both attempts ({lost} in the last one): check the "
        "wiring and the range of the accelerometer and of the displacement sensor"
    )


def _mounting(specimen: Specimen) -> OperatorAction:
    if specimen.beta is None:
        return OperatorAction(OperatorTask.REMOVE_BLOCK, specimen, "Remove the spring and the block from the table.")
    request = f"Set the block upright on its base and mount the spring of beta = {specimen.label:g}."
    return OperatorAction(OperatorTask.MOUNT_SPRING, specimen, request)


def _level(found: Planned) -> str:
    reason = "as requested" if found.binds == "level" else f"limited by {found.binds}"
    return f"probe the table; the level is {found.level:.3g} m/s2, {reason}"


def _fell(specimen: Specimen) -> Generator[Step, Outcome, Unmeasurable]:
    """Request that the block be set upright; returns the error that ends the run."""
    if specimen.beta is None:
        return Unmeasurable("storey 1 has a permanent offset without a standing block: check frame and lasers")
    yield OperatorAction(OperatorTask.STAND_BLOCK_UP, specimen, "The block has fallen. Set it upright on its base.")
    return Unmeasurable("the block fell at a level that should leave it at rest: check its base, or reduce --level")


def _warned(outcome: Played, specimen: Specimen, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """Warn if the measured motion may have lifted the block, since a rocking block changes the system."""
    # samples outside the used periods may be missing
    moved = filled(outcome.signals[:, ACCELERATION])
    share = resting_demands(moved, configuration.sample_rate, specimen, configuration).get(RESTING, 0.0)
    if share > 1.0:
        text = (
            f"the block may have lifted: the overturning moment reached {share:.2f} times the restoring moment of its"
            " weight; reduce --level"
        )
        yield Publish(Warned(text))


def _identified(
    records: Sequence[Played], found: Planned, specimen: Specimen
) -> tuple[TableModel, tuple[float, float]]:
    """Table model, and gain and lead [s] of the displacement sensor relative to the accelerometer."""
    grid = found.grid
    drive = np.array([grid.used(record.drive) for record in records])
    moved = [np.array([grid.used(record.signals[:, at]) for record in records]) for at in (ACCELERATION, DISPLACEMENT)]
    date = datetime.now(UTC).replace(microsecond=0)
    model = identify_table(drive, moved[0], grid.lines, grid.sample_rate, date=date, specimen=mounted_name(specimen))
    spacing = grid.sample_rate / grid.samples
    volts = line_amplitudes(drive, grid.lines)
    each = [line_response(volts, line_amplitudes(of, grid.lines), grid.frequency, spacing) for of in moved]
    return model, sensor_agreement(*each)


def _publish_model(model: TableModel, agreement: tuple[float, float]) -> Generator[Step, Outcome, None]:
    low, high = model.band
    text = f"{model.specimen}, {low:g} to {high:g} Hz, {len(model.frequency)} lines, {model.level:.3g} m/s2 rms"
    columns = ("frequency", "real", "imaginary", "uncertainty", "distortion", "coherence", "noise")
    yield Publish(TableIdentified(text, *(np.array(getattr(model, name)) for name in columns)))
    gain, lead = agreement
    if abs(gain - 1.0) > SENSORS_AGREE or abs(2.0 * np.pi * low * lead) > SENSORS_AGREE:
        yield Publish(
            Warned(
                f"table_displacement measures {gain:.3f} times the motion measured by table_acceleration, with a "
                f"lead of {1e3 * lead:+.2f} ms: check both with `rockbench check`",
            )
        )
