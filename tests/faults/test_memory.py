"""When the memory ends in a run, the output is ramped to zero, with the reason."""

import subprocess
import sys

import numpy as np
import pytest

from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import Arm, Calibrate, Dwell, Plan, Publish, RampOut, Sweep
from bench.events import Event, Progress, State
from bench.testing.loopback import LoopbackBench
from sim.errors import CauseCode
from tests.patience import LONG

OMEGA = 16.0


def _driven() -> Plan:
    yield Arm(0.5)
    yield Calibrate(DriveCalibration.flat(1.0))
    yield Sweep((Segment(1.0, 0.5, OMEGA),))


def _check(bench: LoopbackBench, ending: object) -> None:
    assert ending.status == "failed"  # type: ignore[attr-defined]
    assert "memory" in ending.reason  # type: ignore[attr-defined]
    assert ending.cause.code == CauseCode.MEMORY  # type: ignore[attr-defined]
    assert State.ABORTING in bench.states()
    assert State.HALTED not in bench.states()
    assert bench.rig.played[-1] == 0.0  # type: ignore[attr-defined]
    assert not bench.rig.halted  # type: ignore[attr-defined]


def test_a_plan_without_memory_is_ramped_out() -> None:
    def plan() -> Plan:
        yield from _driven()
        raise MemoryError

    bench = LoopbackBench()
    _check(bench, bench.run(plan()))


@pytest.mark.parametrize("again", [False, True])
def test_a_subscriber_without_memory_is_ramped_out(again: bool) -> None:
    raised: list[Event] = []

    def subscriber(event: Event) -> None:
        if isinstance(event, Progress) and (again or not raised):
            raised.append(event)
            raise MemoryError

    def plan() -> Plan:
        yield from _driven()
        yield Publish(Progress(1.0, 2.0, "dwell"))
        yield Dwell(2)
        yield RampOut(fast=False)

    bench = LoopbackBench(subscriber=subscriber)
    _check(bench, bench.run(plan()))


@pytest.mark.parametrize("moment", ["before the write", "after the write", "before the read"])
def test_memory_that_ends_between_the_rig_and_the_guard_is_ramped_out_without_a_step(moment: str) -> None:
    """The ramp continues from what the rig was really sent, and every sample that it plays is accounted for."""
    bench = LoopbackBench()
    rig = bench.rig
    at = list[int]()
    call, left = ("read" if "read" in moment else "write"), [1]
    real = getattr(rig, call)

    def fails(given: object) -> object:
        now = bench.engine.state is State.RUNNING and abs(rig.played[-1]) > 0.1 and left[0]
        if now:
            at.append(rig.played.size)
        if now and "before" in moment:
            left[0] = 0
            raise MemoryError
        done = real(given)
        if now:
            left[0] = 0
            raise MemoryError
        return done

    setattr(rig, call, fails)

    def plan() -> Plan:
        yield from _driven()
        yield Dwell(20)

    _check(bench, bench.run(plan()))
    assert not left[0]
    played = np.asarray(rig.played)
    steps = np.abs(np.diff(played))
    # the ramp adds to the slew of the drive; what a rig took and did not report is left out once, within the limit
    slew = 400.0 if moment == "after the write" else np.pi / 2.0 * np.abs(played).max() / 0.5
    assert steps[at[0] :].max() <= 1.1 * steps[: at[0] + rig.lead].max() + slew / rig.sample_rate


_HOG = """
import resource
from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import Arm, Calibrate, Dwell, Sweep
from bench.events import Acquired, State
from bench.testing.loopback import LoopbackBench
hog = []
def subscriber(event):
    if isinstance(event, Acquired) and bench.engine.state is State.RUNNING:
        hog.append(bytearray(2**20))
bench = LoopbackBench(subscriber=subscriber)
def plan():
    yield Arm(0.5)
    yield Calibrate(DriveCalibration.flat(1.0))
    yield Sweep((Segment(1.0, 3.0, 16.0),))
    with open("/proc/self/statm") as now:
        used = int(now.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**26, resource.RLIM_INFINITY))
    yield Dwell(10_000)
ending = bench.run(plan())
resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

print(ending.status, ending.cause.code, bench.rig.halted, abs(bench.rig.played[-1]), State.ABORTING in bench.states())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
def test_a_process_whose_memory_ends_while_the_table_is_driven_ramps_it_out() -> None:
    done = subprocess.run([sys.executable, "-c", _HOG], capture_output=True, text=True, timeout=LONG)
    assert done.stdout.split() == ["failed", "memory", "False", "0.0", "True"], done.stderr
