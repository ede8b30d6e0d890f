"""The heading has the texts of the file, and what is read for it is checked like every file of unknown origin."""

from pathlib import Path

import h5py
import pytest

from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.heading import read_heading
from bench.datafile.reader import open_datafile
from sim.errors import InvalidInput
from tests.bench.app.gui.run_files import made, point


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return made(tmp_path / "run", point(16.0, 0.2), operator="A. Meyer")


def test_the_heading_is_that_of_the_reader(path: Path) -> None:
    heading = read_heading(path)
    with open_datafile(path) as record:
        assert heading.metadata == record.metadata
        assert (heading.status, heading.summary, heading.start_time) == (
            record.status, record.summary, record.start_time,
        )  # fmt: skip
    assert heading.metadata["operator"] == "A. Meyer"


@pytest.mark.parametrize("place", ["entry/metadata/operator", "entry/status", "entry/metadata"])
def test_links_are_not_followed(path: Path, place: str) -> None:
    with h5py.File(path, "r+") as file:
        del file[place]
        file[place] = h5py.ExternalLink("another.h5", "/entry/status")
    with pytest.raises(DataFileError, match="link"):
        read_heading(path)


def test_damage_and_other_kinds_are_named(path: Path, tmp_path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["entry/summary"]
    with pytest.raises(DataFileError, match="summary"):
        read_heading(path)
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["a"] = 1.0
    with pytest.raises(InvalidInput, match="not a data file of rocking-bench"):
        read_heading(other)
    with pytest.raises(InvalidInput, match="there is no such file"):
        read_heading(tmp_path / "none.h5")
