"""What the tests on the first edition share."""

import json
import platform
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.first_edition.command import DATA, Rockbench, command, unpack


@pytest.fixture(scope="session")
def rockbench() -> Rockbench:
    """The installed command, in this process."""
    return command


@pytest.fixture(scope="session")
def same_arithmetic() -> bool:
    """Whether this processor computes the last digits as the one that wrote the data; another rounds otherwise."""
    found = np.show_config("dicts")["SIMD Extensions"]["found"]
    here = {"system": platform.system(), "machine": platform.machine(), "simd": found}
    return here == json.loads((DATA / "machine.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Unpacks a data file by name, once for each module of tests."""
    folder = tmp_path_factory.mktemp("first_edition")
    return lambda name: unpack(name, folder)
