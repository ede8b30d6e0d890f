"""The cache of results: exact, named by everything that decides about a result, and harmless when it is damaged."""

import json
import os
from pathlib import Path

import pytest

from bench import result_cache as module
from bench.result_cache import cached


class Computed:
    """A computation that counts how often it is carried out."""

    def __init__(self, result: object) -> None:
        self.result, self.times = result, 0

    def __call__(self) -> object:
        self.times += 1
        return self.result


def test_a_result_is_computed_once_and_keeps_every_digit(result_cache: Path) -> None:
    compute = Computed({"values": [0.1 + 0.2, 1e-300, 1.0, 3], "text": "\u03b2"})
    for _ in range(3):
        assert cached("kind", [1.5, "a"], compute) == compute.result
    assert compute.times == 1
    (entry,) = result_cache.iterdir()
    assert entry.stat().st_mode & 0o077 == 0


@pytest.mark.usefixtures("result_cache")
def test_other_inputs_another_kind_another_program_compute_again(monkeypatch: pytest.MonkeyPatch) -> None:
    compute = Computed(1.0)
    cached("kind", [1.5], compute)
    cached("kind", [1.5000000000000002], compute)
    cached("other", [1.5], compute)
    monkeypatch.setattr(module, "stamp", lambda: ["another source"])
    cached("kind", [1.5], compute)
    assert compute.times == 4


def test_the_stamp_follows_the_sources_the_libraries_and_the_processor(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stamp = module.stamp.__wrapped__
    before = stamp()
    assert before == stamp()
    monkeypatch.setattr(module, "software", lambda: {"numpy": "0"})
    assert stamp() != before
    monkeypatch.undo()
    monkeypatch.setattr("sim.kernel.compiled.processor", lambda: "another")
    assert stamp() != before
    monkeypatch.undo()
    (tmp_path / "sim").mkdir()
    (tmp_path / "sim" / "kernel.py").write_text("a = 1\n")
    monkeypatch.setattr(module, "__file__", str(tmp_path / "bench" / "result_cache.py"))
    one = stamp()
    (tmp_path / "sim" / "kernel.py").write_text("a = 2\n")
    assert stamp() != one


@pytest.mark.parametrize("damage", ["", "{", "[]", "null", json.dumps({"inputs": "others", "result": 2.0})])
def test_a_damaged_entry_is_computed_again_and_replaced(result_cache: Path, damage: str) -> None:
    compute = Computed(1.0)
    cached("kind", [], compute)
    (entry,) = result_cache.iterdir()
    entry.write_text(damage)
    assert [cached("kind", [], compute) for _ in range(2)] == [1.0, 1.0]
    assert compute.times == 2


def test_without_a_folder_or_switched_off_everything_is_computed(
    result_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute = Computed(1.0)
    monkeypatch.setenv(module.SWITCH, "off")
    assert [cached("kind", [], compute) for _ in range(2)] == [1.0, 1.0]
    monkeypatch.delenv(module.SWITCH)
    monkeypatch.setattr("sim.kernel.compiled.cache_folder", lambda: None)
    assert cached("kind", [], compute) == 1.0
    assert compute.times == 3
    assert not result_cache.exists()


def test_a_folder_that_cannot_be_written_costs_no_result(result_cache: Path) -> None:
    result_cache.parent.mkdir(exist_ok=True)
    result_cache.write_text("a file in the way")
    assert cached("kind", [], Computed(1.0)) == 1.0


def test_the_longest_unused_entries_are_removed(result_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 4)
    for k in range(5):
        cached("kind", [k], Computed(k))
        for entry in result_cache.iterdir():
            os.utime(entry, (entry.stat().st_atime, entry.stat().st_mtime - 10.0))
    assert len(list(result_cache.iterdir())) == 2
    last = Computed(4)
    assert cached("kind", [4], last) == 4
    assert last.times == 0
