"""The commands of the benchmark run in their own processes, and their limits are targets."""

import sys

import pytest

from bench.app.benchmark import commands as part
from bench.app.benchmark.commands import Waited, commands
from sim.errors import RockbenchError


def test_a_command_is_measured_and_compared_with_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    # much less than the memory of this process
    kept = bytearray(500_000_000)
    kept[::4096] = b"x" * len(kept[::4096])
    chosen = (Waited("--version", 60.0, "processor_s", memory=200.0, quick=True), Waited("paper --pdf x.pdf", 1.0))
    monkeypatch.setattr(part, "COMMANDS", chosen)
    section = commands(quick=True)
    (row,) = section.rows
    assert row["command"] == "rockbench --version"
    names = [target.name for target in section.targets]
    assert names == ["processor time of --version", "memory of --version, 1000 x 1000", "time of paper"]
    assert section.targets[-1].met is None
    if sys.platform != "win32":
        assert [target.met for target in section.targets[:2]] == [True, True]


def test_a_command_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(part, "COMMANDS", (Waited("predict steady --omega -1", 1.0, quick=True),))
    with pytest.raises(RockbenchError, match=r"predict steady --omega -1 ended with code 2: .*omega"):
        commands(quick=True)
