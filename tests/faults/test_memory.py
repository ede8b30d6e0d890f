"""When the memory ends in a run, the output is ramped to zero, with the reason."""

import subprocess
import sys

import pytest

from bench.control.oscillator import DriveCalibration, Leg
from bench.engine.steps import Arm, Calibrate, Dwell, Plan, Publish, RampOut, Sweep
from bench.events import Event, Progress, State
from bench.testing.loopback import LoopbackBench
from sim.errors import CauseCode

OMEGA = 16.0


def _driven() -> Plan:
    yield Arm(0.5)
    yield Calibrate(DriveCalibration.flat(1.0))
    yield Sweep((Leg(1.0, 0.5, OMEGA),))


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


_HOG = """
import resource
from bench.control.oscillator import DriveCalibration, Leg
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
    yield Sweep((Leg(1.0, 3.0, 16.0),))
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
    done = subprocess.run([sys.executable, "-c", _HOG], capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["failed", "memory", "False", "0.0", "True"], done.stderr
