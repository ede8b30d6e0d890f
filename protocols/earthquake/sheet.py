"""The lab sheet of the seismic campaign (section 5 of the paper).

1. The bare frame: identify the table unless it is known, then for every record learn the drive that makes the table
   follow it, and play that drive once more to measure.
2. For each spring: mount it, and play every record with the drive that was learned with the bare frame. A record that
   topples the block is ended there, and the block is stood up for the next one.

The springs are the outer loop: changing one is hand work.
"""

from collections.abc import Generator, Sequence
from math import tau

import numpy as np

from bench.analysis.signals import DRIFT
from bench.config.model import BenchConfiguration
from bench.control.replication import ReplicationParameters
from bench.control.table_model import TableModel
from bench.engine.steps import Arm, Fallen, Handle, Outcome, Play, Played, RampOut, Say, Step
from bench.events import PointFinished, Progress, StepStarted, Warned
from drivers.rig import Handwork, RigError
from protocols.common.replicate import replicate
from protocols.earthquake.histories import Histories
from protocols.earthquake.judge import BareTest, measured, not_played, overturned
from protocols.earthquake.learned import refused, shortfall
from protocols.earthquake.live import History, Watch
from protocols.earthquake.observed import observe
from protocols.earthquake.pace import Pace
from protocols.earthquake.prediction import Curves, target_gains
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint
from protocols.earthquake.records import Shaking
from protocols.earthquake.shaken import tracking
from protocols.earthquake.table import TableSource, table_for
from sim.errors import InvalidInput
from sim.specimen import Specimen

NO_BLOCK = "the first storey is pulled aside although the block was taken off: check lasers and specimen"

FALLEN_REQUEST = "The block has fallen: stand it up again."

SEED = 5
"""Of the Monte Carlo behind the first point; each further one has the next."""


class EarthquakeSheet:
    """One campaign on one bench: what the plan knows and gathers while it runs."""

    def __init__(
        self,
        parameters: EarthquakeParameters,
        configuration: BenchConfiguration,
        shakings: Sequence[Shaking],
        table: TableSource,
        curves: Curves,
        histories: Histories,
    ) -> None:
        self._parameters, self._configuration, self._histories = parameters, configuration, histories
        self._specimen = configuration.known_specimen
        self._shakings, self._table = shakings, table
        self._targets = target_gains(curves, parameters.beta)
        self._pace = Pace(parameters, shakings, table.duration)
        self._bare: dict[str, BareTest | str] = {}
        self._shortfalls: dict[str, str] = {}
        self._points = 0

    def plan(self) -> Generator[Step, Outcome, None]:
        """The whole campaign as steps."""
        model = yield from table_for(self._table, self._configuration, self._pace)
        for shaking in self._shakings:
            self._bare[shaking.name] = yield from self._bare_frame(shaking, model)
            self._pace.learned(shaking.name)
            yield Say(self._pace.progress(f"finished {shaking.name}, bare frame"))
        for beta in self._parameters.beta:
            yield from self._spring(self._specimen.coupled(beta))

    def _bare_frame(self, shaking: Shaking, model: TableModel) -> Generator[Step, Outcome, BareTest | str]:
        """The bare frame's test, or why there is none."""
        p, limits = self._parameters, self._configuration.limits

        def passed() -> Progress:
            self._pace.played(shaking.name)
            return self._pace.progress(f"the table learns {shaking.name}")

        try:
            learned = yield from replicate(shaking.target, model, limits, self._learning(), shaking.name, passed)
        except InvalidInput as beyond:
            # what one record asks beyond the limits does not keep the others from being played
            yield Say(Warned(f"{shaking.name} is not played: {beyond}"))
            return f"the table cannot make it: {beyond}"
        if learned.fell:
            raise RigError(NO_BLOCK)
        if (reason := refused(learned, p)) is not None:
            yield Say(Warned(f"{shaking.name} is not played: {reason}"))
            return reason
        if lacking := shortfall(learned, p, shaking.target.band[0]):
            self._shortfalls[shaking.name] = lacking
            yield Say(Warned(f"{shaking.name} is played with the best drive so far: {lacking}"))
        yield Say(StepStarted(f"{shaking.name}, bare frame"))
        watch = Watch(shaking.name, None, shaking.target.sample_rate)
        outcome = yield from self._play(shaking, learned.drive, watch)
        if not isinstance(outcome, Played):
            raise RigError(NO_BLOCK)
        rate = shaking.target.sample_rate
        try:
            observed = observe(outcome.signals, shaking.target.rest, rate)
        except InvalidInput as lost:
            yield Say(Warned(f"{shaking.name}, bare frame, shows no peak: {lost}"))
            return f"the bare frame shows no peak: {lost}"
        self._histories.bare(shaking, outcome.signals, History.of(self._specimen.bare(), observed.base).drift)
        return BareTest(
            learned.drive,
            learned.passes,
            learned.status,
            observed,
            outcome.signals,
            tracking(shaking, outcome.signals),
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
        request = f"Stand the block on its base and mount the spring of beta = {specimen.label:g}."
        yield Handle(Handwork.MOUNT_SPRING, specimen, request)
        for shaking in self._shakings:
            bare = self._bare[shaking.name]
            if isinstance(bare, BareTest):
                point = self._noted(shaking, (yield from self._point(shaking, specimen, bare)))
            else:
                point = not_played(shaking, specimen.label or 0.0, self._target(shaking, specimen), None, bare)
            self._pace.played(shaking.name)
            yield Say(self._pace.progress(f"finished {shaking.name}, beta = {specimen.label:g}"))
            yield Say(PointFinished(point))

    def _point(self, shaking: Shaking, specimen: Specimen, bare: BareTest) -> Generator[Step, Outcome, EarthquakePoint]:
        yield Say(StepStarted(f"{shaking.name}, beta = {specimen.label:g}"))
        outcome = yield from self._play(shaking, bare.drive, self._watch(shaking, specimen, bare))
        if isinstance(outcome, Fallen):
            yield Handle(Handwork.STAND_BLOCK_UP, specimen, FALLEN_REQUEST)
        self._points += 1
        target, p = self._target(shaking, specimen), self._parameters
        seed = SEED + self._points
        if isinstance(outcome, Played):
            rate = shaking.target.sample_rate
            try:
                observed = observe(outcome.signals, shaking.target.rest, rate)
            except InvalidInput as lost:
                return not_played(shaking, specimen.label or 0.0, target, bare, f"no peak is to be seen: {lost}")
            expected = History.of(specimen, observed.base).drift
            self._histories.coupled(shaking, specimen.label or 0.0, outcome.signals, expected)
            return measured(
                shaking, specimen, bare, outcome.signals, observed, target, self._configuration, p.draws, seed
            )
        signals = bare.signals[:0] if outcome.signals is None else outcome.signals
        return overturned(shaking, specimen, bare, signals, target, self._configuration, p.draws, seed)

    def _play(
        self, shaking: Shaking, drive: np.ndarray[tuple[int], np.dtype[np.float64]], watch: Watch
    ) -> Generator[Step, Outcome, Played | Fallen]:
        """Play a drive and its decay, and ramp out; a block that falls on the way out has fallen under the record."""
        yield Arm(self._parameters.rest)
        outcome = yield Play(shaking.volts(drive, self._parameters.decay), watch)
        ended = yield RampOut(fast=isinstance(outcome, Fallen))
        if isinstance(outcome, Played):
            return Fallen(outcome.signals) if isinstance(ended, Fallen) else outcome
        if isinstance(outcome, Fallen):
            return outcome
        raise RigError("a drive was played and nothing came of it")

    def _watch(self, shaking: Shaking, specimen: Specimen, bare: BareTest) -> Watch:
        """The running gain; its prediction is for the motion that this drive made with the bare frame."""
        base = bare.observed.base
        expected = (History.of(specimen.bare(), base), History.of(specimen, base))
        noise = bare.observed.drift.peak.uncertainty
        return Watch(shaking.name, specimen.label, shaking.target.sample_rate, bare.signals[:, DRIFT], noise, expected)

    def _noted(self, shaking: Shaking, point: EarthquakePoint) -> EarthquakePoint:
        """With what the drive lacks that it was played with."""
        said = filter(None, (point.reason, self._shortfalls.get(shaking.name)))
        return point.model_copy(update={"reason": "; ".join(said)})

    def _target(self, shaking: Shaking, specimen: Specimen) -> float | None:
        return self._targets[shaking.name, specimen.label or 0.0]
