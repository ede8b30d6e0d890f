"""What goes wrong in a run ends it: relay open, output at zero, the right error, soon."""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from drivers.daqmx.safety import EnableLine
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import ConnectionLost, DeviceTimeout, DriveUnderflow, InputOverflow, RigError
from sim.errors import InvalidInput
from tests.drivers.daqmx.conftest import LEAD, RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe, started
from tests.drivers.daqmx.wire import Wire
from tests.patience import eventually


def test_a_drive_that_was_written_too_late_is_an_underflow(session: DaqSession, plant: Loopback) -> None:
    started(session, np.full(LEAD, 3.0))
    session.read(LEAD + BLOCK)
    with pytest.raises(DriveUnderflow) as caught:
        session.write(np.zeros(BLOCK))
    assert caught.value.code == -200290
    eventually(lambda: is_safe(plant))


def test_a_start_without_drive_is_an_underflow(session: DaqSession, plant: Loopback) -> None:
    session.prepare()
    with pytest.raises(DriveUnderflow) as caught:
        session.start()
    assert caught.value.code == -200462
    eventually(lambda: is_safe(plant))


def test_inputs_that_were_read_too_late_are_an_overflow(open_session: OpenSession, plant: Loopback) -> None:
    session = started(open_session(buffer=1.0), np.full(round(2.0 * RATE), 3.0))
    begin = plant.tick()
    eventually(lambda: plant.tick() > begin + 1.5 * RATE)
    with pytest.raises(InputOverflow):
        session.read(BLOCK)
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize(
    ("call", "code", "expected"),
    [
        ("ReadBinaryI16", -200284, DeviceTimeout),
        ("ReadBinaryI16", -201003, ConnectionLost),
        ("ReadBinaryI16", -200077, RigError),
        ("WriteAnalogF64", -50405, ConnectionLost),
        ("GetReadAttributeUInt64", -200279, InputOverflow),
    ],
)
def test_a_failing_call_ends_the_run(
    session: DaqSession, server: DaqServer, plant: Loopback, call: str, code: int, expected: type[RigError]
) -> None:
    driving(session)
    server.fail_next(call, code)

    def run() -> None:
        session.write(np.zeros(BLOCK))
        session.read(BLOCK)
        session.acquired()

    with pytest.raises(expected) as caught:
        run()
    assert type(caught.value) is expected
    assert caught.value.code == code
    eventually(lambda: is_safe(plant))
    with pytest.raises(RigError, match="stopped by an error"):
        session.read(BLOCK)


@pytest.mark.parametrize(
    "call", ["CfgDigEdgeStartTrig", "WriteDigitalLines", "CreateTask", "CreateAOVoltageChan", "CfgSampClkTiming"]
)
def test_a_session_that_cannot_be_prepared_stays_safe(
    session: DaqSession, server: DaqServer, plant: Loopback, call: str
) -> None:
    server.fail_next(call, -200077)
    with pytest.raises(RigError):
        session.prepare()
    eventually(lambda: is_safe(plant))
    session.stop()
    assert len(started(session).read(10)) == 10


@pytest.mark.parametrize("call", ["StartTask", "WriteAnalogF64"])
def test_a_session_that_cannot_be_started_stays_safe(
    session: DaqSession, server: DaqServer, plant: Loopback, call: str
) -> None:
    session.prepare()

    def start() -> None:
        server.fail_next(call, -200077)
        session.write(np.full(LEAD, 3.0))
        session.start()

    with pytest.raises(RigError):
        start()
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize(("key", "told"), [("start_trigger", "start trigger"), ("clock", "sample clock of the output")])
def test_a_terminal_that_the_device_does_not_have_is_an_error(
    open_session: OpenSession, plant: Loopback, key: str, told: str
) -> None:
    session = open_session(**{key: "/Dev1/PFI99/Nowhere"})
    assert session.description[told] == "/Dev1/PFI99/Nowhere"
    with pytest.raises(RigError, match=r"hardware\.daq\.clock"):
        started(session)
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize("call", ["WriteDigitalLines", "WriteAnalogF64"])
def test_a_stop_that_does_not_reach_relay_or_output_says_so_and_can_be_tried_again(
    session: DaqSession, server: DaqServer, plant: Loopback, call: str
) -> None:
    driving(session)
    server.fail_next(call, -200077)
    with pytest.raises(RigError) as caught:
        session.stop()
    assert caught.value.code == -200077
    assert ("press the emergency stop" in str(caught.value)) is (call == "WriteDigitalLines")
    # the other step was done all the same
    eventually(lambda: plant.present_output() == 0.0 if call == "WriteDigitalLines" else not plant.enabled)
    session.stop()
    eventually(lambda: is_safe(plant))


def test_a_relay_whose_task_does_not_stop_is_reported_though_it_is_open(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    server.fail_next("StopTask", -200077)
    with pytest.raises(RigError, match="releasing the enable relay, which is open"):
        session.stop()
    assert not plant.enabled
    session.stop()
    eventually(lambda: is_safe(plant))


def test_an_output_that_is_not_given_back_is_taken_by_a_reset(
    session: DaqSession, server: DaqServer, plant: Loopback
) -> None:
    driving(session)
    server.fail_next("ClearTask", -200077)
    with pytest.raises(RigError, match="the device was reset"):
        session.stop()
    eventually(lambda: is_safe(plant))
    with pytest.raises(ConnectionLost, match="open a new session"):
        session.prepare()


@pytest.mark.parametrize("mishap", [KeyboardInterrupt, ValueError("a closed channel")])
def test_whatever_happens_in_one_step_of_a_stop_the_others_are_done(
    session: DaqSession, plant: Loopback, monkeypatch: pytest.MonkeyPatch, mishap: BaseException
) -> None:
    driving(session)

    def interrupted(_: EnableLine) -> None:
        raise mishap

    monkeypatch.setattr(EnableLine, "open", interrupted)
    with pytest.raises((KeyboardInterrupt, ValueError)):
        session.stop()
    monkeypatch.undo()
    eventually(lambda: plant.present_output() == 0.0)
    session.close()
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize(
    ("change", "refused"), [({"rate": 1.0e9}, InvalidInput), ({"output": "Dev1/ao9"}, InvalidInput)]
)
def test_an_opening_that_fails_makes_safe_what_a_dead_client_left(
    session: DaqSession, open_session: OpenSession, plant: Loopback, change: dict[str, Any], refused: type[Exception]
) -> None:
    # who does not write any more cannot be told from who has died: its tasks stay on the server
    driving(session)
    assert plant.enabled
    with pytest.raises(refused):
        open_session(**change)
    eventually(lambda: is_safe(plant))


def test_an_opening_that_fails_makes_safe_what_is_left_without_any_task(
    session: DaqSession, open_session: OpenSession, plant: Loopback
) -> None:
    driving(session)
    # as the driver of this PC does when a process ends: lines and outputs stay as they are
    session._tasks.clear()
    assert plant.enabled
    assert plant.present_output() == 3.0
    with pytest.raises(InvalidInput):
        open_session(rate=1.0e9)
    eventually(lambda: is_safe(plant))


def gone_server(server: DaqServer, wire: Wire) -> None:  # noqa: ARG001
    server.vanish()


def pulled_cable(server: DaqServer, wire: Wire) -> None:  # noqa: ARG001
    wire.pull()


def frozen_cable(server: DaqServer, wire: Wire) -> None:  # noqa: ARG001
    wire.freeze()


def stalled_server(server: DaqServer, wire: Wire) -> None:  # noqa: ARG001
    server.stall(60.0)


def read_on(session: DaqSession) -> None:
    while True:
        session.read(BLOCK)


@pytest.mark.seconds
@pytest.mark.parametrize("fault", [gone_server, pulled_cable, frozen_cable, stalled_server])
def test_a_server_that_goes_away_is_noticed_in_time(
    server: DaqServer, open_session: OpenSession, fault: Callable[[DaqServer, Wire], None]
) -> None:
    wire = Wire(server.address)
    try:
        session = driving(open_session(server=wire.address, timeout_margin=0.6))
        begin = time.monotonic()
        fault(server, wire)
        with pytest.raises((ConnectionLost, DeviceTimeout)):
            read_on(session)
        # a quarter of the patience for the device, all of it for the server, and the attempts to make it safe
        assert time.monotonic() - begin < 5.0
        assert session.cut() is False
        with pytest.raises(RigError):
            session.stop()
        with pytest.raises(ConnectionLost, match="open a new session"):
            session.prepare()
    finally:
        wire.close()


def test_a_server_that_was_late_once_is_not_trusted_again(
    server: DaqServer, open_session: OpenSession, plant: Loopback
) -> None:
    session = driving(open_session(timeout_margin=0.6))
    server.stall(1.5)
    with pytest.raises(DeviceTimeout) as caught:
        session.read(BLOCK)
    assert "open a new session" in str(caught.value)
    # the relay was asked for first, and is opened when the server comes back
    eventually(lambda: not plant.enabled)

    def stopped() -> bool:
        with suppress(RigError):
            session.stop()
            return True
        return False

    eventually(stopped)
    eventually(lambda: is_safe(plant))
    with pytest.raises(ConnectionLost):
        session.prepare()
