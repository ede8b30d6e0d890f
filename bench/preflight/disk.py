"""Whether the record of a run fits on its disk."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.events import TwinEstimate
from bench.record.declared import EVENT_TABLES
from sim.errors import InvalidInput

SPARE = 3.0
"""How many times the expected duration must fit: every start may fall, every motion may settle slowly."""

OVERHEAD = 1.1
"""Everything but the samples, as a factor: blocks, events, estimates, tables, and the format itself."""

DRIVE_BYTES = 4
"""Bytes of a sample of the drive in the file."""


@dataclass(frozen=True)
class Room:
    """Bytes that the record may need, uncompressed, and bytes that are free where it goes."""

    folder: Path
    needed: int
    free: int

    def refusal(self) -> InvalidInput | None:
        """Why the run is refused, or None when its record fits."""
        if self.needed <= self.free:
            return None
        sizes = f"the record may need {_readable(self.needed)}, {_readable(self.free)} are free on that disk"
        return InvalidInput("--out", str(self.folder), f"{sizes}; free some, or name a folder on another disk")


def room(configuration: BenchConfiguration, duration: float, folder: Path) -> Room:
    """Room for the record of a run of `duration` [s] in `folder`, which need not exist yet."""
    existing = folder.absolute()
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    needed = bytes_per_second(configuration) * duration * SPARE * OVERHEAD
    return Room(folder, round(needed), shutil.disk_usage(existing).free)


def bytes_per_second(configuration: BenchConfiguration) -> float:
    """Counts of every channel and the drive, 16 bit simulated, up to 32 bit on hardware; and what the twin says."""
    if configuration.backend == "simulated":
        inputs, width = 4, 2
    else:
        inputs, width = len(configuration.hardware.transducers) + 2, 4
    channels = inputs + len(configuration.channels)
    beside = configuration.at_pace(realtime=False).twin.enabled
    said = 8 * len(EVENT_TABLES[TwinEstimate].fields) / configuration.acquisition.block_duration if beside else 0.0
    return configuration.sample_rate * (channels * width + DRIVE_BYTES) + said


def _readable(size: int) -> str:
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
