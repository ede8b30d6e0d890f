"""How the command line tells of a campaign that a fault has ended, and what is found late in a long one."""

from pathlib import Path

import pytest

from bench.app.session import SessionResult
from bench.control.oscillator import Segment
from bench.engine.interface import Requests
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, Plan, RampOut, Sweep
from drivers.rig import OperatorTask
from tests.command_line import main_with
from tests.faults.bench import FaultyBench, run
from tests.faults.catalogue import catalogue
from tests.faults.places import PLACES
from tests.faults.setup import AMPLITUDE, CALIBRATION, COUPLED, OMEGA

FAULTS = {fault.name: fault for fault in catalogue()}
DWELLING = next(place for place in PLACES if place.name == "dwelling")


@pytest.mark.parametrize(
    ("name", "code", "told"),
    [
        ("spike on laser_1", 0, ""),
        ("stop asked for", 0, ""),
        ("abort asked for", 130, "run aborted: abort requested"),
        ("halt asked for", 130, "run halted: halt requested"),
        ("laser_1 invalid", 1, "run aborted: time without a valid sample from laser_1"),
        ("table_displacement invalid", 1, "run halted: table displacement inf m exceeds"),
        ("emergency stop opens", 1, "run halted: emergency stop opened"),
        ("ConnectionLost in read", 1, "run failed: the device is gone"),
        ("disk full", 1, "No space left on device"),
        ("OSError in a subscriber", 1, "pipe"),
    ],
)
def test_exit_status(
    name: str, code: int, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)

    def start(*_: object, requests: Requests, out: Path, **__: object) -> SessionResult:
        out.mkdir(parents=True, exist_ok=True)
        bench = FaultyBench(out / "campaign.h5", DWELLING, FAULTS[name].begin, requests)
        story = run(bench)
        bench.rig.close()
        if story.raised is not None:
            raise story.raised
        return SessionResult(story.status, story.reason, {}, "", requests.strongest is not None)

    assert main_with(start, ["run", "harmonic"]) == code
    assert told in capsys.readouterr().err


def test_clocks_that_drift_apart_end_a_long_run() -> None:
    """Within the 20 s that it takes to tell two clocks apart, the matrix sees nothing of it."""

    def plan() -> Plan:
        yield OperatorAction(OperatorTask.MOUNT_SPRING, COUPLED, "mount the spring")
        yield Arm(0.2)
        yield Calibrate(CALIBRATION)
        yield Sweep((Segment(0.25, AMPLITUDE, OMEGA),))
        yield Dwell(120)
        yield RampOut()

    bench = FaultyBench(None, DWELLING, lambda bench: bench.rig.faulty_clock.drift(0.002))
    story = run(bench, plan())
    assert story.status == "aborted"
    assert "relative difference between the clocks" in story.reason
    assert not story.armed
