"""Faults of sensors, amplifier, clocks, safety inputs, and of the calls of the rig."""

from drivers.errors import ConnectionLost, DeviceTimeout, DriveUnderflow, InputOverflow, RigError
from tests.faults.bench import Begin, FaultyBench
from tests.faults.fault import Fault, borne, fails, heeded, never, of_samples, reads, stays, strikes
from tests.faults.rig import SAFETY_INPUTS, Failure
from tests.faults.samples import (
    at_rail,
    flipped,
    invalid,
    jump,
    late,
    lost_for,
    once,
    shifted,
    shortened,
    spike,
    stuck,
)
from tests.faults.setup import BLOCK

CHANNELS = ("table_displacement", "table_acceleration", "laser_1", "laser_2")
FOR_EVER = float("inf")


def sensors() -> list[Fault]:
    """Channels that are lost, at their rail, stuck, or that lie."""
    found: list[Fault] = []
    for column, name in enumerate(CHANNELS):
        table = name.startswith("table")
        # without its table channels nothing says that the table stands: the enable line is cut after the ramp
        status, says = ("halted", name.replace("_", " ")) if table else ("aborted", f"valid sample from {name}")
        found += [
            of_samples(f"{name} invalid", invalid(column), status, says, stays, may=True),
            of_samples(f"{name} at its rail", at_rail(column), status, says, stays, may=True),
            of_samples(f"{name} stuck", stuck(column), "aborted", f"constant count of {name}", stays, may=True),
            borne(f"spike on {name}", once(spike(column))),
        ]
    every = range(len(CHANNELS))
    return [
        *found,
        of_samples("all channels invalid", invalid(*every), "halted", "table", stays, may=True),
        of_samples("all channels stuck", stuck(*every), "aborted", "constant count of", stays, may=True),
        borne("two samples lost", once(lost_for(1, 2))),
        of_samples("three samples lost", once(lost_for(1, 3)), "aborted", "table acceleration", strikes),
        borne("accelerometer upside down", flipped(1)),
    ]


def _gain(factor: float) -> Begin:
    def begin(bench: FaultyBench) -> None:
        bench.rig.gain = factor

    return begin


def motion() -> list[Fault]:
    """The amplifier gives more than it should."""
    return [Fault("drive gain x3", _gain(3.0), "aborted", "table", stays, True, moves=True)]


def timing() -> list[Fault]:
    """Clocks, and blocks that are not what was asked for. The first block of an arming sets the time of the others."""
    delay, missing = "delay of a block", "samples are missing"
    return [
        of_samples("block 0.4 s late", once(late(0.4), after=1), "aborted", delay, strikes),
        borne("block 0.2 s late", once(late(0.2), after=1)),
        of_samples("clock jumps ahead", once(jump(0.4), after=1), "aborted", delay, strikes),
        borne("clock jumps back", once(jump(-0.4), after=1)),
        Fault("clock 5 % fast", lambda bench: bench.rig.faulty_clock.drift(0.05), "completed", "", never),
        of_samples("gap", shifted(10), "failed", missing, strikes),
        of_samples("short block", once(shortened(7)), "failed", missing, strikes),
        of_samples("block twice", once(shifted(-BLOCK), after=1), "failed", missing, strikes),
    ]


def _disobeying(*calls: str) -> Begin:
    def begin(bench: FaultyBench) -> None:
        for call in calls:
            bench.rig.failures[call] = Failure(ConnectionLost(f"no answer to {call}"), FOR_EVER)
        bench.requests.halt()

    return begin


def calls() -> list[Fault]:
    """Calls of the rig that fail."""
    reading = [DriveUnderflow("the drive ran out"), InputOverflow("samples were overwritten"), RigError("no idea")]
    gone = ConnectionLost("the device is gone")
    reading += [DeviceTimeout("no answer in 1 s"), gone]
    return [
        *(fails(f"{type(error).__name__} in read", "read", error) for error in reading),
        fails("RigError in write", "write", RigError("the buffer is not there")),
        fails("ConnectionLost in write", "write", gone),
        fails("DeviceTimeout in arm", "arm", DeviceTimeout("the relay does not answer")),
        fails("ConnectionLost in arm, armed all the same", "arm", gone, obeys=True),
        fails("RigError in stop, stopped all the same", "stop", RigError("the task was gone"), obeys=True),
        fails("RigError in stop, not stopped", "stop", RigError("the task does not stop")),
        fails("RigError in every stop", "stop", RigError("no task stops"), times=FOR_EVER),
        fails("ConnectionLost in halt, cut all the same", "halt", gone, obeys=True, may=True, must=never),
        fails("RigError in perform", "perform", RigError("the hands do not answer")),
        fails("RigError in interlocks", "interlocks", RigError("the safety inputs do not answer")),
        Fault("halt asked for, enable line stuck", _disobeying("halt"), "failed", "amplifier off", heeded, True),
        Fault(
            "halt asked for, nothing obeys",
            _disobeying("halt", "stop"),
            "failed",
            "emergency stop",
            heeded,
            True,
            disobeys=True,
        ),
    ]


def _opens(name: str) -> Begin:
    def begin(bench: FaultyBench) -> None:
        bench.rig.safety[name] = False

    return begin


def _flickers(bench: FaultyBench) -> None:
    bench.rig.safety["emergency stop"] = False
    bench.later(2, lambda: bench.rig.safety.update({"emergency stop": True}))


def safety() -> list[Fault]:
    """Safety inputs that open, for good or for a moment; before arming, arming is refused."""
    opened = [Fault(f"{name} opens", _opens(name), "halted|failed", f"{name} open", reads) for name in SAFETY_INPUTS]
    return [*opened, Fault("emergency stop flickers", _flickers, "halted|failed", "emergency stop open", reads)]
