"""Tables go into a file and come back as they were."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from bench.datafile.fields import fields_of
from bench.datafile.tables import Column, read, write
from sim import parameters


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    table = {
        "beta": Column(np.array([0.25, 0.64]), "1", "stiffness ratio"),
        "record": Column(np.array(["L’Aquila", "Kobe"]), "", "name"),
        "stable": Column(np.array([True, False]), "1", "whether it is stable"),
    }
    with h5py.File(tmp_path / "made.h5", "w") as file:
        write(file, "gains", table)
        back = read(file["gains"])
    for name, column in table.items():
        assert back[name].values.tolist() == column.values.tolist()
        assert back[name].values.dtype.kind == column.values.dtype.kind
        assert (back[name].unit or "1", back[name].description) == (column.unit or "1", column.description)


def test_long_columns_of_text_are_written_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.datafile.hdf5.MANY", 3)
    plain, wide = ["rocking", "", "resting", "up", "rocking"], ["β", "Kobe", "L’Aquila", "", "Gölcük"]
    with h5py.File(tmp_path / "made.h5", "w") as file:
        table = {"plain": Column(np.array(plain), "", "ASCII"), "wide": Column(np.array(wide), "", "other characters")}
        write(file, "motions", table)
        assert [each.asstr()[:].tolist() for each in file["motions"].values()] == [plain, wide]
        # as wide as the longest in UTF-8
        assert [each.dtype.itemsize for each in file["motions"].values()] == [7, len("L’Aquila".encode())]


def test_a_switch_that_is_absent_is_neither_true_nor_false(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "made.h5", "w") as file:
        stored = file.create_dataset("points/agrees", data=np.array([1, 0, -1], np.int8))
        stored.attrs.update({"kind": "switch", "units": "1", "description": "whether it agrees"})
        values = read(file["points"])["agrees"].values
    np.testing.assert_array_equal(values, [1.0, 0.0, np.nan])


Number = TypeVar("Number", bound=np.generic)
Alias = TypeAliasType("Alias", np.ndarray[Any, np.dtype[Number]], type_params=(Number,))
"""What NDArray is in NumPy 2.5 and later."""


@dataclass(frozen=True)
class Spectrum:
    frequency: NDArray[np.float64] = parameters.column("Hz", "frequency")  # noqa: RUF009 - it declares
    amplitude: Alias[np.float64] = parameters.column("m", "amplitude")  # noqa: RUF009 - it declares
    lines: int = parameters.column("1", "number of lines")


def test_an_array_is_one_by_its_type_and_by_an_alias_of_it() -> None:
    assert [field.array for field in fields_of(Spectrum)] == [True, True, False]
