"""A halt cuts the enable line in the thread that asks, while the loop still waits for its block."""

import signal
import sys
from threading import Event as Flag
from threading import Thread

import pytest

from bench.engine.interface import Requests
from drivers.clock import VirtualClock
from drivers.rig import RigError
from drivers.simulated import SimulatedRig
from tests.faults.bench import FaultyBench, Story, run
from tests.patience import LONG


class Gate(VirtualClock):
    """Time stands still at the gate until it is opened."""

    def __init__(self) -> None:
        super().__init__()
        self.closed, self.reached, self.opened = False, Flag(), Flag()

    def wait_until(self, instant: float) -> None:
        if self.closed:
            self.reached.set()
            assert self.opened.wait(LONG)
        super().wait_until(instant)


def _at_the_gate() -> tuple[FaultyBench, Gate, Thread, list[Story]]:
    """A campaign in its own thread whose third turn waits for its block."""
    bench, gate, stories = FaultyBench(None), Gate(), list[Story]()
    assert isinstance(bench.rig.inner, SimulatedRig)
    bench.rig.inner.clock = gate
    bench.later(3, lambda: setattr(gate, "closed", True))
    thread = Thread(target=lambda: stories.append(run(bench)))
    thread.start()
    assert gate.reached.wait(LONG)
    return bench, gate, thread, stories


def test_the_enable_line_is_cut_before_the_loop_knows() -> None:
    bench, gate, thread, stories = _at_the_gate()
    assert bench.rig.armed
    bench.requests.halt()
    assert not bench.rig.armed
    assert bench.rig.cuts == 1
    assert not stories
    gate.opened.set()
    thread.join(LONG)
    assert [(story.status, story.reason) for story in stories] == [("halted", "halt requested")]


def test_an_abort_waits_for_its_block() -> None:
    """The counter-proof: what is no halt leaves the rig alone until the loop ramps it out."""
    bench, gate, thread, stories = _at_the_gate()
    bench.requests.abort()
    assert bench.rig.armed
    gate.opened.set()
    thread.join(LONG)
    assert [story.status for story in stories] == ["aborted"]
    assert bench.rig.cuts == 0


@pytest.mark.skipif(sys.platform == "win32", reason="raises a signal within its own process")
@pytest.mark.parametrize("turn", range(1, 25, 3))
def test_a_signal_may_come_in_the_middle_of_any_call(turn: int) -> None:
    """A second Ctrl-C runs its handler in the thread of the loop, inside whatever that is doing."""
    bench = FaultyBench(None)
    before = signal.signal(signal.SIGINT, lambda *_: bench.requests.halt())
    try:
        bench.later(turn, lambda: signal.raise_signal(signal.SIGINT))
        story = run(bench)
    finally:
        signal.signal(signal.SIGINT, before)
    assert story.status == "halted"
    assert not story.armed


def test_a_cut_that_fails_in_the_asking_thread_is_left_to_the_loop() -> None:
    requests, tried = Requests(), list[bool]()

    def cut() -> None:
        tried.append(True)
        raise RigError("the line is stuck")

    requests.cut_by(cut)
    requests.halt()
    assert tried == [True]
    assert requests.strongest == "halt"
