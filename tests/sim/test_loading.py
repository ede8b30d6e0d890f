"""The helper that compiles a part of the kernel: what it delivers, and that nobody waits for one that fails."""

import pytest

from sim import loading
from sim.loading import APART, BENCH, MODEL, RECORDS, STEADY, helped
from sim.waiting import wait


def ended(script: str, names: list[str], monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each module need not be awaited, after a helper that executes `script`."""
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(loading, "_HELPER", script)
    with helped(names) as ready:
        assert set(ready) == set(names)
        return [wait(event, 60.0) for event in ready.values()]


@pytest.mark.parametrize(
    "script",
    [
        "import sys\nfor name in sys.argv[2:]: print(name, flush=True)",
        "raise SystemExit(3)",
        "print('something else')",
    ],
)
def test_a_helper_that_delivers_or_fails_is_not_awaited_longer(script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ended(script, ["resting", "rocking"], monkeypatch) == [True, True]


def test_a_delivered_module_is_not_held_up_by_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    script = "import sys, time\nprint(sys.argv[2], flush=True)\ntime.sleep(600)"
    monkeypatch.setattr(loading, "_HELPER", script)
    with helped(["resting", "rocking"]) as ready:
        assert wait(ready["resting"], 60.0)
        assert not ready["rocking"].is_set()
    # the helper has ended with the block
    assert ready["rocking"].is_set()


def test_there_is_no_helper_where_it_saves_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    with helped([]) as ready:
        assert ready == {}
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    with helped(["resting"]) as ready:
        assert ready == {}
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr("sys.executable", "/nowhere/python")
    with helped(["resting"]) as ready:
        assert ready == {}


def test_the_helper_compiles_modules_that_are_loaded() -> None:
    assert set(APART) <= set(BENCH)
    assert set(STEADY) < set(MODEL) < set(BENCH)
    assert set(MODEL) < set(RECORDS)
