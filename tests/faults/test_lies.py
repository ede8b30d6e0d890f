"""What a rig backend returns is checked once, at the border: no lie passes or brings a traceback; the file is whole."""

import json
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.config import backend as backends
from bench.config.backend import RigBackend
from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration, Segment
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, RampOut, Sweep
from bench.rigs import open_rig
from bench.testing.loopback import LoopbackBench
from drivers.errors import BackendFault
from drivers.rig import OperatorTask, Rig
from sim.specimen import Specimen
from tests.faults import lies
from tests.faults.lies import Lie, LyingRig
from tests.installed import example

IN_RUN = [*lies.blocks(), *lies.safety(), *lies.clocks(), *lies.calls()]
IN_PLAN = [lie for lie in IN_RUN if not lie.name.startswith("close ")]
"""Those that an engine meets; it is the session that closes the rig."""
AT_OPENING = [*lies.channels(), *lies.numbers()]
ENDED = ("failed", "halted")
"""The rig is stopped with its output cut."""


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    with example(tmp_path_factory.mktemp("plugins") / "site", "tone_sweep"):
        yield


Backend = Callable[[Callable[[], Any]], Any]


@contextmanager
def _backend(monkeypatch: pytest.MonkeyPatch, make: Callable[[], Any]) -> Generator[list[Any]]:
    """The simulated backend opens what `make` returns instead; the rigs that were opened."""
    opened: list[Any] = []

    def open_it(*_: object) -> Any:
        opened.append(make())
        return opened[-1]

    def load(name: str) -> RigBackend:
        return replace(backends.load_backend(name), open=open_it)

    with monkeypatch.context() as patch:
        patch.setattr("bench.rigs.load_backend", load)
        yield opened


def _tone_sweep(out: Path) -> int:
    return main(["run", "tone-sweep", "--omega", "40", "--cycles", "4", "--out", str(out), "--json"])


def _each(lies: list[Lie]) -> Any:
    return pytest.mark.parametrize("lie", lies, ids=lambda lie: lie.name)


def _sessions(every: int) -> list[Any]:
    """One lie in `every`, and those that only a session meets; the others when long tests are asked for."""
    return [
        pytest.param(lie, id=lie.name, marks=() if number % every == 0 or lie not in IN_PLAN else pytest.mark.soak)
        for number, lie in enumerate(IN_RUN)
    ]


def test_there_are_at_least_sixty() -> None:
    assert len({lie.name for lie in [*IN_RUN, *AT_OPENING]}) >= 60


@pytest.mark.usefixtures("plugged")
def test_a_rig_that_tells_the_truth_completes_the_same_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with _backend(monkeypatch, LyingRig):
        assert _tone_sweep(tmp_path / "run") == 0


@_each(IN_PLAN)
def test_a_lie_ends_the_run_with_the_backend_named(lie: Lie) -> None:
    rig = lie.make()
    bench = LoopbackBench(rig)  # type: ignore[arg-type]
    ending = bench.run_steps(
        OperatorAction(OperatorTask.MOUNT_SPRING, Specimen().coupled(0.4), "a spring"),
        Arm(0.5),
        Calibrate(DriveCalibration.flat(1.0)),
        Sweep((Segment(0.5, 0.5, 16.0),)),
        Dwell(2),
        RampOut(fast=False),
    )
    assert ending.status in ENDED
    assert lie.says in ending.reason
    assert not rig.inner.armed


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize("lie", _sessions(every=20))
def test_a_lie_ends_a_session_with_the_backend_named_and_the_file_whole(
    lie: Lie, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    with _backend(monkeypatch, lie.make) as opened:
        assert _tone_sweep(out) == 1
    said = capsys.readouterr()
    summary = json.loads(said.out)
    assert summary["status"] in ENDED
    assert lie.says in summary["reason"]
    assert "Traceback" not in said.err
    (rig,) = opened
    assert not rig.inner.armed
    assert verify(out / "campaign.h5").problems == ()
    with open_datafile(out / "campaign.h5") as record:
        assert record.status == summary["status"]


@_each(AT_OPENING)
def test_a_lie_about_itself_is_refused_before_anything_is_armed(lie: Lie, monkeypatch: pytest.MonkeyPatch) -> None:
    with _backend(monkeypatch, lie.make) as opened, pytest.raises(BackendFault) as refused:
        open_rig(BenchConfiguration(), realtime=False)
    assert lie.says in str(refused.value)
    assert "simulated" in str(refused.value)
    assert refused.value.cause.subject == "simulated"
    assert opened[0].inner._state.value == "closed"


@_each(lies.alignments())
def test_alignments_that_are_none_are_reported_as_unknown(lie: Lie) -> None:
    from bench.engine.steps import AcquireAtRest
    from bench.events import Warned

    bench = LoopbackBench(lie.make())  # type: ignore[arg-type]
    assert bench.run_steps(AcquireAtRest(0.2)).status == "completed"
    assert any(lie.says in event.text for event in bench.events if isinstance(event, Warned))


@pytest.mark.parametrize("given", [None, 5, "rig", {}], ids=str)
def test_what_is_no_rig_is_refused(given: object, monkeypatch: pytest.MonkeyPatch) -> None:
    with _backend(monkeypatch, lambda: given), pytest.raises(BackendFault, match="simulated"):
        open_rig(BenchConfiguration(), realtime=False)


def test_a_backend_that_breaks_down_while_opening_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def make() -> Rig:
        raise AttributeError("no device")

    with _backend(monkeypatch, make), pytest.raises(BackendFault, match=r"simulated.*AttributeError: no device"):
        open_rig(BenchConfiguration(), realtime=False)


def test_a_block_is_a_copy_that_the_backend_cannot_change() -> None:
    rig = LyingRig()
    bench = LoopbackBench(rig)  # type: ignore[arg-type]
    checked = bench.checked
    checked.arm()
    checked.write(np.zeros(checked.lead + 10))
    kept: list[Any] = []
    rig._change, rig.blocks = lambda block: kept.append(block) or block, lies.LATER
    block = checked.read(10)
    kept[0].counts[:] = 7
    assert not (block.counts == 7).all()
