"""Faults of the DAQ device, its server and the way to it."""

import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from threading import Timer
from typing import Any

import nidaqmx.system
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure
from tests.faults.emulated.bench import WiredBench
from tests.faults.emulated.fault import Reach, WiredFault, armed, before, on, while_driven, while_read
from tests.faults.emulated.setup import PATIENCE, SETTING
from tests.faults.emulated.witness import Cable, frozen, rail
from tests.faults.fault import never, stays

HIDDEN_TIME = 0.5 * SETTING.lead / SETTING.rate
"""A hold-up that the lead bears [s]."""
TOO_LONG = 1.5 * SETTING.lead / SETTING.rate
"""One that it does not, while the output plays on."""

_FAILING: tuple[tuple[str, int, Reach], ...] = (
    ("ReadBinaryI16", -200279, while_read),
    ("ReadBinaryI16", -200284, while_read),
    ("ReadBinaryI16", -200278, while_read),
    ("ReadBinaryI16", -201003, while_read),
    ("ReadBinaryI16", -50405, while_read),
    ("WriteAnalogF64", -200290, while_read),
    ("WriteAnalogF64", -200621, while_read),
    ("WriteDigitalLines", -200077, while_read),
    ("StartTask", -50103, before("armed again")),
    ("StopTask", -200088, while_read),
    ("ReadDigitalLines", -200279, while_read),
    ("CfgSampClkTiming", -89137, before("second waiting")),
    ("ControlWatchdogTask", -200650, while_driven),
)
"""Calls, with what DAQmx may say to them."""


def _fails(call: str, code: int, reach: Reach) -> WiredFault:
    def begin(bench: Any) -> None:
        bench.laboratory.daq.fail_next(call, code)

    def fired(bench: WiredBench) -> bool:
        return bench.begun and not bench.faults._codes.get(call)

    name = DAQmxErrors(code).name
    return WiredFault(f"{call}: {code}", begin, "failed", name, on, reach=reach, fired=fired)


def _removed(bench: Any) -> None:
    """The device no longer answers; its outputs stay as they are, as those of one with a supply of its own do."""
    left: list[str] = bench.calls

    def strike(call: str) -> None:
        left.append(call)
        raise DaqmxFailure(DAQmxErrors.DEVICE_REMOVED, "Device was removed.")

    bench.faults.strike = strike


def _reset_by_another(bench: Any) -> None:
    """Another program resets the device: every task on it is gone, outputs and lines are as at power-up."""
    import grpc
    from nidaqmx.grpc_session_options import GrpcSessionOptions

    made: Any = grpc
    with made.insecure_channel(bench.laboratory.daq.address) as channel:
        system = nidaqmx.system.System.remote(GrpcSessionOptions(channel, ""))
        next(device for device in system.devices if device.name == "Dev1").reset_device()


def _cuts(bench: Any) -> None:
    """The connection to the server breaks in the middle of a call, and a new one can be made."""
    port = int(bench.laboratory.daq.address.rpartition(":")[2])

    def cut() -> None:
        for number in map(int, os.listdir("/dev/fd")):
            with suppress(OSError), socket.socket(fileno=os.dup(number)) as end:
                if end.getpeername()[1] == port:
                    end.shutdown(socket.SHUT_RDWR)
                    bench.rig.struck.append("cut")

    Timer(0.4 * SETTING.block / SETTING.rate, cut).start()


def _begun(bench: WiredBench) -> bool:
    return bench.begun


def _cut(bench: WiredBench) -> bool:
    return "cut" in bench.rig.struck


def _called(bench: WiredBench) -> bool:
    return bool(bench.calls)


def _holds_up(seconds: float) -> Callable[[Any], None]:
    """The program itself is kept from its work in its next turn."""

    def begin(bench: Any) -> None:
        def wait() -> None:
            bench.rig.struck.append("held up")
            time.sleep(seconds)

        bench.later(1, wait)

    return begin


def daq() -> list[WiredFault]:
    """Calls that fail, servers that stall or go, devices that are lost, a program that is late."""
    held: Callable[[WiredBench], bool] = lambda bench: "held up" in bench.rig.struck  # noqa: E731
    failed = partial(WiredFault, status="failed", must=on)
    lost = partial(failed, unreachable=True)
    borne = partial(WiredFault, status="completed", says="", must=never)
    return [
        *(_fails(*one) for one in _FAILING),
        replace(_fails("ClearTask", -200088, while_read), says="INVALID_TASK|the device was reset"),
        # a buffer that is full for a moment is no failure; a zero that cannot be written is
        replace(_fails("WriteAnalogF64", -200292, while_read), must=never, may=True),
        *(
            lost(f"{name}, {keeper} only", begin, says=says, fired=fired, **{other: False})
            for keeper, other in (("watchdog", "heartbeat"), ("heartbeat", "watchdog"))
            for name, begin, says, fired in (
                # nobody is called any more
                ("server gone", _gone, "UNAVAILABLE", _begun),
                ("device removed", _removed, "Device was removed", _called),
                ("server stalled", _stalls(10.0 * PATIENCE), "DEADLINE_EXCEEDED", _called),
            )
        ),
        # between two calls it is made anew, and nobody sees that
        failed("connection cut", _cuts, says="UNAVAILABLE", must=never, may=True, fired=_cut),
        # between two runs nothing is lost by it
        failed(
            "device reset by another",
            _reset_by_another,
            status="halted|failed",
            says="amplifier ready|Task|Generation",
            must=armed,
            may=True,
        ),
        borne("server stalled a moment", _stalls(HIDDEN_TIME), fired=_called),
        # a clock that has not been started yet does not run away; where only zeros are left to be played, they are late
        failed(
            "output runs dry",
            _holds_up(TOO_LONG),
            status="aborted|failed",
            says="prevent the regeneration|delay of a block",
            must=armed,
            may=True,
            fired=held,
        ),
        borne("program held up a moment", _holds_up(HIDDEN_TIME), fired=held),
    ]


def _gone(bench: Any) -> None:
    bench.laboratory.daq.vanish()


def _stalls(seconds: float) -> Callable[[Any], None]:
    return lambda bench: bench.laboratory.daq.stall(seconds)


def _cable(column: int, make: Callable[[], Cable]) -> Callable[[Any], None]:
    def begin(bench: Any) -> None:
        bench.witness.cables[column] = make()

    return begin


def cables() -> list[WiredFault]:
    """Sensors on analogue inputs that break or freeze."""
    found: list[WiredFault] = []
    for column, name in enumerate(("table_displacement", "table_acceleration", "laser_1", "laser_2")):
        table = name.startswith("table")
        status, says = ("halted", name.replace("_", " ")) if table else ("aborted", f"valid sample from {name}")
        stuck = f"constant count of {name}"
        found += [
            WiredFault(f"{name} at its rail", _cable(column, lambda: rail), status, says, stays, True),
            WiredFault(f"{name} frozen", _cable(column, frozen), "aborted", stuck, stays, True),
        ]
    return found
