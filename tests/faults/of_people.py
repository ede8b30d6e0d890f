"""Faults of plans, of those who listen, of the disk and of the operator; and the requests of a person."""

import errno
from functools import partial
from threading import Thread

from bench.control.oscillator import DriveCalibration, Segment
from bench.engine.steps import Calibrate, SetHarmonics, Step, Sweep
from sim.errors import RockbenchError
from tests.faults.bench import Begin, FaultyBench
from tests.faults.fault import Fault, answered, asks, heeded, never, reads, strikes
from tests.faults.setup import GAIN

_strikes = partial(Fault, must=strikes, recorded=True)


def _does(step: Step | Exception) -> Begin:
    def begin(bench: FaultyBench) -> None:
        bench.extra.append(step)

    return begin


def plans() -> list[Fault]:
    """Steps that ask for what is not allowed, and plans that break down."""
    bad: dict[str, Step] = {
        "nan": SetHarmonics((complex("nan"),)),
        "over-range": Calibrate(DriveCalibration.flat(GAIN / 10.0)),
        # 1.6 V and more at 500 rad/s change by 800 V/s and more
        "slewing": Sweep((Segment(0.02, 4.0, 500.0),)),
    }
    return [
        *(_strikes(f"{name} drive", _does(step), "aborted", "drive") for name, step in bad.items()),
        _strikes("mistake in the plan", _does(ZeroDivisionError("sheet")), "failed", "sheet", raises=ZeroDivisionError),
        _strikes("the plan gives up", _does(RockbenchError("no steady state")), "failed", "no steady state"),
    ]


def _raises(error: BaseException, *, always: bool = False) -> Begin:
    def begin(bench: FaultyBench) -> None:
        bench.raising, bench.raises_always = error, always

    return begin


def subscribers() -> list[Fault]:
    """Whoever listens breaks down."""
    return [
        _strikes("OSError in a subscriber", _raises(OSError("pipe")), "failed", "pipe", raises=OSError),
        _strikes(
            "OSError in a subscriber, always", _raises(OSError("pipe"), always=True), "failed", "pipe", raises=OSError
        ),
        _strikes("an analysis gives up", _raises(RockbenchError("no cycles")), "failed", "no cycles"),
        _strikes(
            "an analysis gives up, always", _raises(RockbenchError("no cycles"), always=True), "failed", "no cycles"
        ),
        _strikes("KeyboardInterrupt", _raises(KeyboardInterrupt("key")), "failed", "key", raises=KeyboardInterrupt),
    ]


def _full(bench: FaultyBench) -> None:
    bench.disk.error = OSError(errno.ENOSPC, "No space left on device")


def _hangs(bench: FaultyBench) -> None:
    assert bench.recorder is not None
    bench.disk.free.clear()
    # from now on as if in real time: nobody waits for the disk
    bench.recorder._hold_up = 0.0  # pyright: ignore[reportPrivateUsage]


def _hangs_and_recovers(bench: FaultyBench) -> None:
    _hangs(bench)
    bench.recovers = True


def disks() -> list[Fault]:
    """The file cannot be written: told by the run, or at the latest when the file is closed."""
    return [
        Fault("disk full", _full, "failed", "No space left on device", never, True, disk="full"),
        Fault("disk hangs for ever", _hangs, "failed", "its disk", never, True, disk="hung"),
        Fault("disk hangs and recovers", _hangs_and_recovers, "failed", "its disk", never, True, disk="slow"),
    ]


def _declines(bench: FaultyBench) -> None:
    bench.person.agrees = False


def _operator(error: BaseException) -> Begin:
    def begin(bench: FaultyBench) -> None:
        bench.person.error = error

    return begin


def operators() -> list[Fault]:
    """The person at the bench says no, or cannot be asked."""
    gone = RockbenchError("nobody can answer")
    return [
        Fault("operator declines", _declines, "aborted", "declined", answered),
        _strikes("operator cannot be asked", _operator(gone), "failed", "nobody can answer"),
        _strikes(
            "KeyboardInterrupt at the question",
            _operator(KeyboardInterrupt("key")),
            "failed",
            "key",
            raises=KeyboardInterrupt,
        ),
    ]


def _halt_from_another_thread(bench: FaultyBench) -> None:
    thread = Thread(target=bench.requests.halt)
    thread.start()
    thread.join()


def requests() -> list[Fault]:
    """A person ends the run, in any order."""
    return [
        asks("stop", status="stopped"),
        asks("abort", status="aborted"),
        asks("halt", status="halted", must=reads),
        asks("stop", "abort", status="aborted"),
        asks("abort", "stop", status="aborted", says="abort requested"),
        asks("abort", "abort", status="aborted"),
        asks("stop", "abort", "halt", status="halted", must=reads),
        asks("halt", "halt", status="halted", must=reads),
        Fault("halt from another thread", _halt_from_another_thread, "halted", "halt requested", reads, True),
        *(_sequence(*pair) for pair in (("stop", "abort"), ("stop", "halt"), ("abort", "halt"), ("abort", "stop"))),
    ]


def _sequence(first: str, second: str) -> Fault:
    """The second request comes two turns later, in the ramp that the first has begun."""

    def begin(bench: FaultyBench) -> None:
        getattr(bench.requests, first)()
        bench.later(2, lambda: getattr(bench.requests, second)())

    ways = {"stop": "stopped", "abort": "aborted", "halt": "halted"}
    return Fault(f"{first}, then {second}", begin, f"{ways[first]}|{ways[second]}", "requested", heeded, True)
