"""What the tests of the link share."""

from collections.abc import Generator

import pytest

from bench.app.catalogue import PROTOCOLS
from tests.installed import installed


@pytest.fixture(scope="session", autouse=True)
def _shaking_is_installed(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """The sessions of these tests are processes of their own, and find their protocol as they find every other."""
    entry_points = {PROTOCOLS: {"shaking": "tests.bench.app.ipc.experiment:SHAKING"}}
    with installed(tmp_path_factory.mktemp("shaking"), "rockbench-shaking", entry_points):
        yield
