"""The laser calibration file: what a calibration found, kept for later runs."""

from pathlib import Path

from bench.analysis.laser_calibration import LaserCalibration
from bench.config.kept_file import KeptFile
from bench.config.validation import dotted, validated

FILE = KeptFile(
    item="laser calibration",
    format="rocking-bench laser calibration",
    version=1,
    remedy="`rockbench run laser-calibration` makes one",
)


def write_calibration(path: Path, calibration: LaserCalibration) -> None:
    """Write a new file: JSON, SI units. Raises InvalidInput when `path` exists or cannot be written."""
    FILE.write(path, calibration.model_dump(mode="json"))


def read_calibration(path: Path) -> LaserCalibration:
    """What a file holds. Raises InvalidInput naming file and key."""
    return validated(LaserCalibration, FILE.read(path), lambda where: f"{path.name}: {dotted(where)}")
