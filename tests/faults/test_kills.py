"""A program that is killed while it records, in real time: at most a second is lost, and the restored file replays."""

import os
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from tests.faults.kills import COMMANDS, kill


def test_every_protocol_is_killed() -> None:
    ours = {each.name for each in entry_points(group="rockbench.protocols") if each.value.startswith("protocols.")}
    assert set(COMMANDS) == ours


@pytest.mark.soak
@pytest.mark.skipif(os.name != "posix", reason="kills processes the POSIX way")
@pytest.mark.parametrize("protocol", COMMANDS)
def test_a_killed_run_loses_at_most_a_second_and_replays(protocol: str, tmp_path: Path) -> None:
    found = kill(protocol, 3.3, 1, tmp_path)
    assert found is not None
    assert found.good, found
