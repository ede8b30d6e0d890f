"""Steps of the seismic campaign (section 5 of the paper).

1. With the bare frame, the table is identified unless it is known, and the lasers are checked if this is requested.
   Then, for every record, the drive is iterated until the table follows the record, and is played once more for the
   measurement.
2. Each spring is mounted in turn, and every record is played with the drive found with the bare frame. If the block
   topples, the record is ended and the block is set upright.

The springs form the outer loop, since they are changed by hand.
"""

from collections import Counter
from collections.abc import Collection, Generator, Mapping, Sequence
from dataclasses import replace
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.error_curve import Checks
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.signals import ACCELERATION, DRIFT
from bench.config.model import BenchConfiguration
from bench.control.replication import Replication, ReplicationParameters
from bench.control.table_model import TableModel
from bench.engine.steps import Arm, Done, Fallen, OperatorAction, Outcome, Play, Played, Publish, RampOut, Step, Watch
from bench.events import Event, PointFinished, Progress, StepStarted, Warned
from bench.protocol import each_step
from drivers.rig import OperatorTask, RigError
from protocols.common.identification.plan import identified
from protocols.common.replicate import replicate, table_motion
from protocols.common.sine.settling import linear_frame
from protocols.earthquake.laser_check import LaserCheck, LasersChecked
from protocols.earthquake.measurement import GainMonitor, Histories, History, tracking
from protocols.earthquake.observation import Observed, observe
from protocols.earthquake.points import (
    BareTest,
    measured_point,
    overturned_point,
    rejection,
    shortfall,
    unplayed_point,
)
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint
from protocols.earthquake.records import LeftOut, Shaking
from protocols.earthquake.table import TableSource
from sim.errors import InvalidInput
from sim.specimen import Specimen

NO_BLOCK = "storey 1 has a permanent offset although the block was removed: check lasers and specimen"

FALLEN_REQUEST = "The block has fallen: set it upright again."

OMITTED = "omitted, since it would exceed a limit"

SEED = 5
"""Seed of the Monte Carlo simulations: the k-th played point, k = 1, 2, ..., uses `SEED` + k."""


BETWEEN = 45.0
"""Typical time between records, in which the storeys come to rest [s]."""


class Pace:
    """Progress of a campaign, weighted by the durations of the `identification` [s] and of the records, excluding the
    combinations in `left_out`.
    """

    def __init__(
        self,
        parameters: EarthquakeParameters,
        shakings: Sequence[Shaking],
        identification: float = 0.0,
        left_out: Collection[tuple[str, float | None]] = (),
        check: LaserCheck | None = None,
    ) -> None:
        self._each = {
            shaking.name: shaking.target.duration + parameters.decay + parameters.rest + BETWEEN for shaking in shakings
        }
        self._bare = {name: 0 if (name, None) in left_out else parameters.passes + 1 for name in self._each}
        if check is not None:
            self._each[check.shaking.name] = check.shaking.target.duration + parameters.decay + parameters.rest
            self._bare[check.shaking.name] = 1
        self._identification = identification
        springs = dict.fromkeys(self._each, 0) | {
            shaking.name: sum((shaking.name, beta) not in left_out for beta in parameters.beta) for shaking in shakings
        }
        self.total = identification + sum(
            (self._bare[name] + springs[name]) * each for name, each in self._each.items()
        )
        """Expected duration of the campaign [s]."""
        self._identified = 0.0
        self._played = Counter[str]()

    def identified(self, share: float = 1.0) -> None:
        """Set the completed fraction `share` of the table's identification."""
        self._identified = share * self._identification

    def played(self, record: str) -> None:
        """Count one play of a record: a pass, or a test with a spring."""
        self._played[record] += 1

    def finish_replication(self, record: str) -> None:
        """Finish the bare-frame part of a record; unused passes count as completed."""
        self._played[record] = self._bare[record]

    def progress(self, activity: str) -> Progress:
        played = sum(count * self._each[record] for record, count in self._played.items())
        gone = min(self._identified + played, self.total)
        return Progress(gone / self.total, self.total - gone, activity)


class EarthquakePlan:
    """Steps of a campaign, and the bare-frame tests that later steps require."""

    def __init__(
        self,
        parameters: EarthquakeParameters,
        configuration: BenchConfiguration,
        shakings: Sequence[Shaking],
        table: TableSource,
        targets: Mapping[tuple[str, float], float | None],
        left_out: LeftOut,
        histories: Histories,
        check: LaserCheck | None = None,
    ) -> None:
        self._parameters, self._configuration, self._histories = parameters, configuration, histories
        self._specimen = configuration.known_specimen
        self._shakings, self._table = shakings, table
        self._targets, self._left_out = targets, left_out
        self._pace = Pace(parameters, shakings, table.duration, left_out, check)
        self._check = check
        self._correction = ReadingCorrection(configuration.sensors.corrected_by(None))
        self._checked = list[NDArray[np.float64]]()
        self._bare: dict[str, BareTest | str] = {}
        self._shortfalls: dict[str, str] = {}
        self._points = 0

    def steps(self) -> Generator[Step, Outcome, None]:
        """Steps of the complete campaign."""
        model = yield from table_model(self._table, self._configuration, self._pace)
        if self._check is not None:
            checks = yield from self._check_lasers(self._check, model)
            self._correction = ReadingCorrection(self._configuration.sensors.corrected_by(checks))
            if checks is not None:
                yield Publish(LasersChecked.of(self._correction))
        for shaking in self._shakings:
            if (omitted := self._left_out.get((shaking.name, None))) is not None:
                self._bare[shaking.name] = f"{OMITTED}: {omitted}"
                continue
            self._bare[shaking.name] = yield from self._bare_frame(shaking, model)
            self._pace.finish_replication(shaking.name)
            yield Publish(self._pace.progress(f"{shaking.name} finished, bare frame"))
        for beta in self._parameters.beta:
            yield from self._spring(self._specimen.coupled(beta))

    def _check_lasers(self, check: LaserCheck, model: TableModel) -> Generator[Step, Outcome, Checks | None]:
        """Harmonics of the lasers' readings under a sine; None, with a warning, if it cannot be played or evaluated."""
        shaking = check.shaking
        yield Publish(StepStarted(f"{shaking.name}, bare frame: {'; '.join(shaking.prepared.steps)}"))
        try:
            # what the table adds to the sine is measured, so that its drive is not iterated
            drive = Replication(shaking.target, model, self._configuration.limits).drive
            outcome = yield from self._play(shaking, drive, GainMonitor(shaking.name, None, shaking.target.sample_rate))
            if not isinstance(outcome, Played):
                raise RigError(NO_BLOCK)
            found = check.evaluate(self._correction(outcome.signals), self._configuration)
            self._checked.append(outcome.signals)
        except InvalidInput as refused:
            yield Publish(Warned(f"the lasers are not checked, and alpha_2 is less accurate: {refused}"))
            found = None
        self._pace.played(shaking.name)
        yield Publish(self._pace.progress(f"{shaking.name} finished"))
        return found

    def _bare_frame(self, shaking: Shaking, model: TableModel) -> Generator[Step, Outcome, BareTest | str]:
        """Test of the bare frame, or the reason why there is none."""
        p, limits = self._parameters, self._configuration.limits

        def passed() -> Progress:
            self._pace.played(shaking.name)
            return self._pace.progress(f"replicating {shaking.name}")

        try:
            replication = yield from replicate(shaking.target, model, limits, self._learning(), shaking.name, passed)
        except InvalidInput as beyond:
            # the campaign continues with the other records
            yield Publish(Warned(f"{shaking.name} is not played: {beyond}"))
            return f"the table cannot reproduce it: {beyond}"
        if replication.fell:
            raise RigError(NO_BLOCK)
        if (reason := rejection(replication, p)) is not None:
            yield Publish(Warned(f"{shaking.name} is not played: {reason}"))
            return reason
        if lacking := shortfall(replication, p, shaking.target.band[0]):
            self._shortfalls[shaking.name] = lacking
            yield Publish(Warned(f"{shaking.name} is played with the best drive so far: {lacking}"))
        yield Publish(StepStarted(f"{shaking.name}, bare frame"))
        monitor = GainMonitor(shaking.name, None, shaking.target.sample_rate, correction=self._correction)
        outcome = yield from self._play(shaking, replication.drive, monitor)
        if not isinstance(outcome, Played):
            raise RigError(NO_BLOCK)
        signals = self._correction(outcome.signals)
        try:
            observed = self._observed(shaking, signals, self._correction)
        except InvalidInput as lost:
            yield Publish(Warned(f"{shaking.name}: the test of the bare frame cannot be evaluated: {lost}"))
            return f"the test of the bare frame cannot be evaluated: {lost}"
        self._histories.bare(shaking, signals, History.of(self._specimen.bare(), observed.base).drift)
        return BareTest(
            replication.drive,
            replication.passes,
            replication.status,
            observed,
            signals,
            tracking(shaking, signals),
            outcome.signals,
        )

    def _learning(self) -> ReplicationParameters:
        p, modes = self._parameters, self._specimen.frame.natural_frequencies
        return ReplicationParameters(
            passes=p.passes,
            tolerance=p.tolerance,
            spectrum_tolerance=p.spectrum_tolerance,
            spectrum_periods=tuple(tau / omega for omega in modes),
        )

    def _spring(self, specimen: Specimen) -> Generator[Step, Outcome, None]:
        if any((shaking.name, specimen.label) not in self._left_out for shaking in self._shakings):
            request = f"Set the block upright on its base and mount the spring of beta = {specimen.label:g}."
            yield OperatorAction(OperatorTask.MOUNT_SPRING, specimen, request)
        for shaking in self._shakings:
            bare = self._bare[shaking.name]
            omitted = self._left_out.get((shaking.name, specimen.label))
            if omitted is not None:
                bare = f"{OMITTED}: {omitted}"
            if isinstance(bare, BareTest):
                point = self._remarked(shaking, (yield from self._point(shaking, specimen, bare)))
            else:
                point = unplayed_point(shaking, specimen.label or 0.0, self._target(shaking, specimen), None, bare)
            if omitted is None:
                self._pace.played(shaking.name)
            yield Publish(self._pace.progress(f"{shaking.name} finished, beta = {specimen.label:g}"))
            yield Publish(PointFinished(point))

    def _point(self, shaking: Shaking, specimen: Specimen, bare: BareTest) -> Generator[Step, Outcome, EarthquakePoint]:
        yield Publish(StepStarted(f"{shaking.name}, beta = {specimen.label:g}"))
        outcome = yield from self._play(shaking, bare.drive, self._running_gain(shaking, specimen, bare))
        if isinstance(outcome, Fallen):
            yield OperatorAction(OperatorTask.STAND_BLOCK_UP, specimen, FALLEN_REQUEST)
        self._points += 1
        target, p = self._target(shaking, specimen), self._parameters
        seed = SEED + self._points
        if isinstance(outcome, Played):
            play = f"beta = {specimen.label:g}"
            yield Publish(table_motion(shaking.name, play, shaking.target, outcome.signals[:, ACCELERATION]))
            correction = self._found_in(bare.raw, outcome.signals)
            signals = correction(outcome.signals)
            try:
                observed = self._observed(shaking, signals, correction)
                if correction is not self._correction:
                    again = correction(bare.raw)
                    bare = replace(bare, observed=self._observed(shaking, again, correction), signals=again)
            except InvalidInput as lost:
                return unplayed_point(shaking, specimen.label or 0.0, target, bare, f"not evaluated: {lost}")
            expected = History.of(specimen, observed.base).drift
            self._histories.coupled(shaking, specimen.label or 0.0, signals, expected)
            return measured_point(
                shaking,
                specimen,
                bare,
                signals,
                observed,
                target,
                self._configuration,
                p.draws,
                seed,
                correction.sensors,
            )
        signals = bare.signals[:0] if outcome.signals is None else self._correction(outcome.signals)
        return overturned_point(shaking, specimen, bare, signals, target, self._configuration, p.draws, seed)

    def _found_in(self, *tests: NDArray[np.float64]) -> ReadingCorrection:
        """Correction for the errors of the lasers that these tests, and the check, reveal; otherwise that of the
        campaign.
        """
        before, frame = self._correction.sensors, linear_frame(self._configuration)
        block = self._parameters.laser_block or 0.0
        sensors = before.found_in([*self._checked, *tests], frame, self._configuration.sample_rate, block)
        return self._correction if sensors is before else ReadingCorrection(sensors)

    def _observed(self, shaking: Shaking, signals: NDArray[np.float64], correction: ReadingCorrection) -> Observed:
        """Evaluate the corrected signals of a record. The zero from momentum has the errors of the lasers at all places
        of the motion: it is evaluated if these errors were calibrated or found, or their shapes checked.
        """
        frame = linear_frame(self._configuration) if correction.sensors.shapes_known else None
        return observe(signals, shaking.target.rest, shaking.target.sample_rate, frame)

    def _play(
        self, shaking: Shaking, drive: NDArray[np.float64], monitor: GainMonitor
    ) -> Generator[Step, Outcome, Played | Fallen]:
        """Play a drive and the decay after it, and ramp out; the signals are not corrected. A fall during the ramp is
        treated as a fall under the record.
        """
        yield Arm(self._parameters.rest)
        outcome = yield Play(shaking.volts(drive, self._parameters.decay), monitor)
        ended = yield RampOut(fast=isinstance(outcome, Fallen))
        if isinstance(outcome, Played):
            return Fallen(outcome.signals) if isinstance(ended, Fallen) else outcome
        if isinstance(outcome, Fallen):
            return outcome
        raise RigError("playing a drive returned no result")

    def _running_gain(self, shaking: Shaking, specimen: Specimen, bare: BareTest) -> GainMonitor:
        """Monitor of the running gain; its prediction is for the table motion achieved with the bare frame."""
        base = bare.observed.base
        expected = (History.of(specimen.bare(), base), History.of(specimen, base))
        noise = bare.observed.drift.peak.uncertainty
        return GainMonitor(
            shaking.name,
            specimen.label,
            shaking.target.sample_rate,
            bare.signals[:, DRIFT],
            noise,
            expected,
            self._correction,
        )

    def _remarked(self, shaking: Shaking, point: EarthquakePoint) -> EarthquakePoint:
        """The point, with the drive's missed tolerances added to the remarks."""
        said = filter(None, (point.reason, self._shortfalls.get(shaking.name)))
        return point.model_copy(update={"reason": "; ".join(said)})

    def _target(self, shaking: Shaking, specimen: Specimen) -> float | None:
        return self._targets[shaking.name, specimen.label or 0.0]


def table_model(
    source: TableSource, configuration: BenchConfiguration, pace: Pace
) -> Generator[Step, Outcome, TableModel]:
    """The stored table model, or a newly identified one; in both cases the spring and the block are removed first."""
    if source.model is not None or source.plan is None:
        assert source.model is not None
        bare = configuration.known_specimen.bare()
        yield OperatorAction(OperatorTask.REMOVE_BLOCK, bare, "Remove the spring and the block from the table.")
        return source.model

    def carry_out(step: Step) -> Generator[Step, Outcome, Outcome]:
        # only the campaign's progress is published, not the identification's
        if isinstance(step, Publish) and isinstance(step.event, Progress):
            return Done()
        return (yield replace(step, watch=_counted(step.watch, pace)) if isinstance(step, Play) else step)

    model = yield from each_step(identified(source.parameters, configuration, source.plan), carry_out)
    pace.identified()
    return model


def _counted(watch: Watch | None, pace: Pace) -> Watch | None:
    """Callback of an identification whose progress is converted to the campaign's."""
    if watch is None:
        return None

    def progress(signals: NDArray[np.float64]) -> Event | None:
        event = watch(signals)
        if not isinstance(event, Progress):
            return event
        pace.identified(event.fraction)
        return pace.progress("identifying the table")

    return progress
