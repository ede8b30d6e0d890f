"""Check of a run before its start: forecast, margin to every limit, disk space, and the hash of the plan."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

from bench.config.model import BenchConfiguration
from bench.config.review import Review, review
from bench.config.usual import notices_of, scales_of
from bench.datafile.declared import EVENT_TABLES
from bench.datafile.tables import Table
from bench.live_values import TwinEstimate
from bench.plugins import plugin_code
from bench.preflight.margins import Forecast, Margin, bounds, drive_table, margins, margins_table, refusal, warnings
from bench.progress import Progress, silent
from bench.protocol import Prepared, Protocol
from bench.provenance import software
from sim.channel import STOREYS
from sim.errors import InvalidInput
from sim.loading import BENCH, load_model
from sim.parameters import Parameters

SPARE = 3.0
"""Factor allowed for a run longer than expected, since a start may fail and a motion may settle slowly."""

OVERHEAD = 1.1
"""Factor for contents other than samples: blocks, events, estimates, tables, and the overhead of the format."""

DRIVE_BYTES = 4
"""Bytes per drive sample in the file."""
RAW_BYTES = 6
"""Estimated bytes per raw value of a serial laser in the file, compressed."""


@dataclass(frozen=True)
class DiskSpace:
    """Bytes that the data file may need, and bytes that are free on the disk of its `folder`."""

    folder: Path
    needed: int
    free: int

    def refusal(self) -> InvalidInput | None:
        """Error for a run whose data file may not fit, or None."""
        if self.needed <= self.free:
            return None
        sizes = f"the data file may need {_readable(self.needed)}, but {_readable(self.free)} are free on that disk"
        return InvalidInput("--out", str(self.folder), f"{sizes}; free disk space, or choose a folder on another disk")


def disk_space(configuration: BenchConfiguration, duration: float, folder: Path) -> DiskSpace:
    """Disk space for the data file of a run of `duration` [s] in `folder`, which need not exist yet."""
    existing = folder.absolute()
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    needed = bytes_per_second(configuration) * duration * SPARE * OVERHEAD
    return DiskSpace(folder, round(needed), shutil.disk_usage(existing).free)


def bytes_per_second(configuration: BenchConfiguration) -> float:
    """Data rate [B/s] of all channels, the drive, the twin's estimates and the raw values of serial lasers. Counts have
    16 bits on the simulated bench, and up to 32 bits otherwise.
    """
    inputs = len(configuration.hardware.transducers) + 2 if configuration.backend == "hardware" else 4
    width = 2 if configuration.backend == "simulated" else 4
    channels = inputs + len(configuration.channels)
    enabled = configuration.at_pace(realtime=False).twin.enabled
    estimates = (
        8 * len(EVENT_TABLES[TwinEstimate].fields) / configuration.acquisition.block_duration if enabled else 0.0
    )
    lasers = configuration.hardware.lasers
    is_serial = configuration.backend == "hardware" and lasers.connection == "serial"
    raw = len(STOREYS) * lasers.rate * RAW_BYTES if is_serial else 0.0
    return configuration.sample_rate * (channels * width + DRIVE_BYTES) + estimates + raw


def _readable(size: int) -> str:
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"


DIGITS = 9
"""Significant digits of computed numbers in the hash; rounding errors, which depend on the processor, are smaller."""


def plan_hash(
    protocol: str, parameters: Parameters, configuration: BenchConfiguration, version: str, forecast: Forecast
) -> str:
    """SHA-256, as 64 hexadecimal digits, of canonical JSON: sorted keys, no spaces, no NaN.

    Requested values are hashed exactly, computed ones to nine digits.
    """
    content = {
        "protocol": protocol,
        "parameters": parameters.model_dump(mode="json"),
        "configuration": configuration.model_dump(mode="json"),
        "software": version,
        "forecast": _rounded(asdict(forecast)),
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return sha256(text.encode("utf-8")).hexdigest()


def _rounded(value: Any) -> Any:
    """The content, with every float as a string of `DIGITS` significant digits."""
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}"
    if isinstance(value, dict):
        return {str(key): _rounded(item) for key, item in cast(dict[Any, Any], value).items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in cast(list[Any], value)]
    return value


@dataclass(frozen=True)
class Preflight:
    """Result of the check of a run before its start.

    margins : margin to each limit, in ascending order.
    room : disk space; None if the duration of the run is unknown.
    sensors : warnings about sensor calibrations.
    reviewed : cross-checks of configuration and parameters.
    scales : notes that state each circular frequency in rad/s and in Hz.
    """

    forecast: Forecast
    margins: tuple[Margin, ...]
    room: DiskSpace | None
    plan_hash: str
    sensors: tuple[str, ...] = ()
    reviewed: Review = field(default_factory=lambda: Review((), ()))
    scales: tuple[str, ...] = ()

    @property
    def refusal(self) -> InvalidInput | None:
        """Error due to the configuration, the binding limit or the disk, in this order; None if the run may begin."""
        contradiction = next(iter(self.reviewed.refusals), None)
        return contradiction or refusal(self.margins) or (self.room.refusal() if self.room else None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the processing of the input."""
        return (*self.scales, *self.forecast.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings that do not prevent the run."""
        return (*self.sensors, *self.reviewed.notices, *self.forecast.warnings, *warnings(self.margins))

    @property
    def tables(self) -> Mapping[str, Table]:
        """The non-empty tables for the data file."""
        kept: dict[str, Table] = {}
        if self.margins:
            kept["preflight"] = margins_table(self.margins)
        if any(stage.segments for stage in self.forecast.stages):
            kept["planned_drive"] = drive_table(self.forecast.stages)
        return kept

    def require(self) -> None:
        """Raise InvalidInput with the reason if the run is refused."""
        if (refused := self.refusal) is not None:
            raise refused


def load_bench(configuration: BenchConfiguration, progress: Progress = silent) -> None:
    """Load the compiled simulation of a simulated bench, or compile it on first use."""
    if configuration.backend == "simulated":
        load_model(progress, BENCH)


def prepare(
    protocol: Protocol[Any], parameters: Parameters, configuration: BenchConfiguration, progress: Progress = silent
) -> Prepared[Any]:
    """A protocol prepared for a new run on a bench. Raises InvalidInput if the bench is unsuitable."""
    load_bench(configuration, progress)
    progress("checking the protocol against the bench")
    with plugin_code(f"the protocol {protocol.name}"):
        return protocol.prepare(parameters, configuration, None)


def compile_run(protocol: str, prepared: Prepared[Any], folder: Path, progress: Progress = silent) -> Preflight:
    """Compute and check the complete run of a protocol, with results in `folder`, without opening a device or creating
    a file. Raises InvalidInput only for a run that cannot be planned; a refusal is part of the result.
    """
    prepared.progress = progress
    forecast, configuration = prepared.forecast, prepared.configuration
    found, specimen = review(configuration), configuration.known_specimen
    return Preflight(
        forecast=forecast,
        margins=margins(forecast.demands, bounds(configuration)),
        room=None if forecast.duration is None else disk_space(configuration, forecast.duration, folder),
        plan_hash=plan_hash(protocol, prepared.parameters, configuration, software()["rocking-bench"], forecast),
        sensors=(*_aged(configuration), *_unpredicted(configuration)),
        reviewed=Review(found.refusals, (*found.notices, *notices_of(prepared.parameters, specimen))),
        scales=scales_of(prepared.parameters, specimen),
    )


def _aged(configuration: BenchConfiguration) -> tuple[str, ...]:
    """Warning if the calibration of the lasers is too old."""
    said = None if configuration.calibrated is None else configuration.calibrated.expired(datetime.now(UTC))
    return () if said is None else (said,)


def _unpredicted(configuration: BenchConfiguration) -> tuple[str, ...]:
    """Warnings about limits on additional channels of the configuration, for which no margin is predicted."""
    return tuple(
        f"a run ends if the limit on {channel.name} is exceeded, but no margin to this limit is predicted"
        for channel in configuration.channels
        if channel.limit is not None
    )
