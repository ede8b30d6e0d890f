"""Results of a run that other runs can use: identified specimen, table model and laser calibration."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from bench.config.model import BenchConfiguration
from bench.config.result_files import read_calibration, read_specimen
from bench.config.review import review
from bench.config.toml import with_identified
from bench.control.table_model import TableModel

Kind = Literal["specimen", "table model", "laser calibration"]
ENDINGS: dict[str, Kind] = {
    "specimen.json": "specimen",
    "table_model.json": "table model",
    "laser_calibration.json": "laser calibration",
}
"""Kinds of result by the endings of the file names that runs and re-analyses write."""


@dataclass(frozen=True)
class UsableResult:
    """A result file and its kind."""

    path: Path
    kind: Kind

    def applied(self, configuration: BenchConfiguration) -> BenchConfiguration:
        """The configuration with its corresponding values replaced by this result. Raises InvalidInput if the file
        cannot be read, or if the result is not valid for the bench.
        """
        if self.kind == "specimen":
            changed = with_identified(configuration, read_specimen(self.path))
        elif self.kind == "laser calibration":
            found = read_calibration(self.path)
            changed = configuration.model_copy(update={"laser_calibration": None, "calibrated": found})
        else:
            model = TableModel.read(self.path)
            model.require_fresh(datetime.now(UTC))
            model.require_rate(configuration.sample_rate)
            changed = configuration.model_copy(update={"table_model": str(self.path.absolute())})
        review(changed).require()
        return changed


def results_in(folder: Path) -> list[UsableResult]:
    """The usable results in the folder of a run, in the order of `ENDINGS`."""
    return [UsableResult(path, kind) for end, kind in ENDINGS.items() for path in sorted(folder.glob(f"*{end}"))]
