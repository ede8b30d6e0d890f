"""An exception in the code of a plug-in ends the run as a failed one, ramped to zero, and names the plug-in."""

import json
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from bench.engine.interface import Ended, Ending
from bench.events import StateChanged
from bench.plugins import PluginFailed, plugin_code
from sim.errors import RockbenchError
from tests.installed import example

Said = pytest.CaptureFixture[str]
ERRORS = (ZeroDivisionError("sheet"), OSError(5, "Input/output error"), RecursionError("deep"))
# every error while the table is driven, one before it is; the others with the mark soak
BREAKDOWNS = [
    pytest.param(after, error, marks=() if after == 6 or error is ERRORS[0] else pytest.mark.soak)
    for after in (1, 6)
    for error in ERRORS
]


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    with example(tmp_path_factory.mktemp("plugins") / "site", "tone_sweep"):
        yield


def _run(out: Path) -> int:
    return main(["run", "tone-sweep", "--omega", "40", "--cycles", "4", "--out", str(out), "--json"])


def _breaking(error: BaseException, after: int) -> Callable[[Any], Any]:
    """A plan that raises `error` after so many steps."""

    def broken(plan: Any) -> Any:
        step = next(plan)
        for _ in range(after):
            step = plan.send((yield step))
        raise error

    return broken


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize(("after", "error"), BREAKDOWNS)
def test_a_plan_that_breaks_down_is_named_and_the_drive_ramped_to_zero(
    error: Exception, after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    prepared = _prepared()
    plan, broken = prepared.plan, _breaking(error, after)
    monkeypatch.setattr(prepared, "plan", lambda self: broken(plan(self)))
    assert _run(tmp_path / "run") == 1
    said = capsys.readouterr()
    summary = json.loads(said.out)
    assert summary["status"] == "failed"
    for part in ("tone-sweep", type(error).__name__, "test_plugins.py"):
        assert part in summary["reason"]
    assert "Traceback" not in said.err
    path = tmp_path / "run" / "campaign.h5"
    assert verify(path).problems == ()
    with open_datafile(path) as record:
        assert record.status == "failed"
        assert "halted" not in [row["after"] for row in record.rows_of(StateChanged)]
        assert not record.drive()[-1:].any()


def _prepared() -> type[Any]:
    """The class of the example protocol's prepared runs."""
    protocol = load_protocol("tone-sweep")
    return type(protocol.prepare(protocol.parameters(omega=(10.0, 40.0)), BenchConfiguration(), None))


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize("part", ["forecast", "prediction", "sources", "result"])
def test_other_parts_of_a_protocol_that_break_down_are_named(
    part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    prepared = _prepared()

    def breaks(*_: object) -> None:
        raise KeyError("no such part")

    if part == "result":
        plan = prepared.plan
        # without a result of the plan, the points are evaluated
        monkeypatch.setattr(prepared, "plan", lambda self: (yield from plan(self)) and None)
        monkeypatch.setattr(prepared, "result", breaks)
    else:
        monkeypatch.setattr(prepared, part, property(breaks))
    assert _run(tmp_path / "run") in (1, 2)
    said = capsys.readouterr()
    assert "tone-sweep" in json.loads(said.out)["error"]["message"]
    assert json.loads(said.out)["error"]["code"] == "plug_in"
    assert "Traceback" not in said.err


def test_errors_of_this_program_keep_their_type() -> None:
    with pytest.raises(RockbenchError) as kept, plugin_code("the protocol x"):
        raise RockbenchError("no steady state")
    assert not isinstance(kept.value, PluginFailed)
    with pytest.raises(OSError, match="full"), plugin_code("the export format x", files=True):
        raise OSError(28, "disk full")


def test_a_request_to_end_the_run_is_no_failure_of_the_code_that_it_interrupts() -> None:
    ended = Ended(Ending("aborted", "abort requested"))
    with pytest.raises(Ended) as raised, plugin_code("the protocol harmonic"):
        raise ended
    assert raised.value is ended
