"""A run before it runs: its forecast, the margin to every limit, room on the disk, and the hash of it all."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.config.model import BenchConfiguration
from bench.config.review import Review, notices_of, review, scales_of
from bench.preflight.bounds import bounds
from bench.preflight.disk import Room, room
from bench.preflight.fingerprint import plan_hash
from bench.preflight.forecast import Forecast
from bench.preflight.margins import Margin, margins, refusal, warnings
from bench.preflight.tables import drive_table, margins_table
from bench.progress import Progress, silent
from bench.protocol import Prepared, Protocol
from bench.provenance import software
from bench.record.tables import Table
from sim.errors import InvalidInput
from sim.loading import BENCH, load_model
from sim.parameters import Parameters


@dataclass(frozen=True)
class Preflight:
    """What was found. `margins` are tightest first; `room` is None where the run's duration is not known; `sensors` is
    what is to be said of their calibration; `reviewed` are the cross-checks of configuration and parameters, and
    `scales` the frequencies in both units.
    """

    forecast: Forecast
    margins: tuple[Margin, ...]
    room: Room | None
    plan_hash: str
    sensors: tuple[str, ...] = ()
    reviewed: Review = field(default_factory=lambda: Review((), ()))
    scales: tuple[str, ...] = ()

    @property
    def refusal(self) -> InvalidInput | None:
        """Why the run is refused: a contradiction of the configuration, the limit that binds, else the disk; None when
        it may run.
        """
        contradiction = next(iter(self.reviewed.refusals), None)
        return contradiction or refusal(self.margins) or (self.room.refusal() if self.room else None)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was made of the input."""
        return (*self.scales, *self.forecast.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the operator should know although the run may begin."""
        return (*self.sensors, *self.reviewed.notices, *self.forecast.warnings, *warnings(self.margins))

    @property
    def tables(self) -> Mapping[str, Table]:
        """What the file keeps, empty tables left out."""
        kept: dict[str, Table] = {}
        if self.margins:
            kept["preflight"] = margins_table(self.margins)
        if any(stage.legs for stage in self.forecast.stages):
            kept["planned_drive"] = drive_table(self.forecast.stages)
        return kept

    def require(self) -> None:
        """Raise InvalidInput, naming what binds, when the run is refused."""
        if (refused := self.refusal) is not None:
            raise refused


def load_bench(configuration: BenchConfiguration, progress: Progress = silent) -> None:
    """Load what simulates this bench, or compile it at the first use, where it is a simulated one."""
    if configuration.backend == "simulated":
        load_model(progress, BENCH)


def prepare(
    protocol: Protocol[Any], parameters: Parameters, configuration: BenchConfiguration, progress: Progress = silent
) -> Prepared[Any]:
    """A protocol prepared for a new run on this bench. Raises InvalidInput where the bench cannot do it."""
    load_bench(configuration, progress)
    progress("checking the protocol against the bench")
    return protocol.prepare(parameters, configuration, None)


def compile_run(protocol: str, prepared: Prepared[Any], folder: Path, progress: Progress = silent) -> Preflight:
    """Compute and check the whole run of the protocol of this name; its results would go to `folder`.

    Opens nothing, creates nothing. Raises InvalidInput only for what cannot be planned at all: a refusal is part of
    the answer.
    """
    prepared.progress = progress
    forecast, configuration = prepared.forecast, prepared.configuration
    found, specimen = review(configuration), configuration.known_specimen
    return Preflight(
        forecast=forecast,
        margins=margins(forecast.demands, bounds(configuration)),
        room=None if forecast.duration is None else room(configuration, forecast.duration, folder),
        plan_hash=plan_hash(protocol, prepared.parameters, configuration, software()["rocking-bench"], forecast),
        sensors=(*_aged(configuration), *_unpredicted(configuration)),
        reviewed=Review(found.refusals, (*found.notices, *notices_of(prepared.parameters, specimen))),
        scales=scales_of(prepared.parameters, specimen),
    )


def _aged(configuration: BenchConfiguration) -> tuple[str, ...]:
    """A word where the lasers' calibration is too old."""
    said = None if configuration.calibrated is None else configuration.calibrated.expired(datetime.now(UTC))
    return () if said is None else (said,)


def _unpredicted(configuration: BenchConfiguration) -> tuple[str, ...]:
    """A word for each limit of a further channel: margins say nothing of it."""
    return tuple(
        f"the limit of {channel.name} ends a run, but what the plan asks of it is not predicted"
        for channel in configuration.channels
        if channel.limit is not None
    )
