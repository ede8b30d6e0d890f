"""Checks, before anything starts, that the results of a run can be written and overwrite nothing."""

import tempfile
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bench.results import FILE, SUMMARY
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.session import Experiment


def result_names(experiment: "Experiment") -> tuple[str, ...]:
    """File names of everything that a run of `experiment` leaves in its folder."""
    kept = getattr(experiment, "kept_name", None)
    further = getattr(experiment, "further_figures", ())
    return (FILE, experiment.figure_name, *further, SUMMARY, *([kept] if kept else []))


def default_folder(protocol: str, now: datetime) -> Path:
    """`runs/<protocol>-<date>T<time>`; hyphens in the time, because a colon is not allowed on every system."""
    return Path("runs", f"{protocol}-{now:%Y-%m-%dT%H-%M-%S}")


def check_folder(folder: Path, results: Iterable[str]) -> None:
    """Refuse a folder that cannot take the `results` of a run. Leaves nothing behind, and creates no folder.

    Raises InvalidInput naming what stands in the way.
    """
    existing = folder
    try:
        for name in results:
            if (folder / name).exists():
                raise InvalidInput("--out", str(folder), f"it holds {name} already; results are never overwritten")
        while not existing.exists() and existing != existing.parent:
            existing = existing.parent
        if not existing.is_dir():
            raise InvalidInput("--out", str(folder), f"{existing} is a file; give a folder")
        # permission bits do not tell the truth on every file system: try it
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise InvalidInput("--out", str(folder), f"{existing} cannot be written: {error.strerror}") from None
