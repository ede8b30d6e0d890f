"""Contacts that are read by the real client: what they say, what they cost, and what becomes of a read that fails."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from drivers.daqmx.parameters import AnalogInput, Daq, EmergencyStop
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.models import compact_rio
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import RigError
from sim.errors import InvalidInput
from tests.drivers.daqmx.conftest import RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe, started
from tests.drivers.daqmx.wired import HEARTBEAT, INPUTS, LINES, Contacts, wired
from tests.patience import eventually

NAMES = ["emergency stop", "over-travel", "over-travel 2", "amplifier ready"]


@pytest.fixture
def contacts() -> Contacts:
    return Contacts(timeout=0.5)


@pytest.fixture
def server(plant: Loopback, contacts: Contacts) -> Iterator[DaqServer]:
    with wired(plant, contacts) as server:
        yield server


@pytest.mark.parametrize("good", ["high", "low"])
def test_each_input_is_told_by_its_name_at_rest_and_in_a_run(
    open_session: OpenSession, contacts: Contacts, good: str
) -> None:
    contacts.levels = dict.fromkeys(contacts.levels, good == "high")
    session = open_session(**{name: {"good": good} for name in LINES})
    for running in (False, True):
        if running:
            driving(session)
        assert session.safety_inputs() == dict.fromkeys(NAMES, True)
        for line, name in zip(LINES.values(), NAMES, strict=True):
            contacts.levels[line] = good != "high"
            assert session.safety_inputs() == dict.fromkeys(NAMES, True) | {name: False}
            contacts.levels[line] = good == "high"


def test_the_relay_stays_open_while_an_input_is_open(
    open_session: OpenSession, contacts: Contacts, plant: Loopback
) -> None:
    session = open_session(**INPUTS)
    contacts.levels[LINES["over_travel"]] = False
    with pytest.raises(RigError, match="cannot be prepared: over-travel open"):
        session.prepare()
    assert not plant.ever_enabled


def test_a_read_is_one_call_to_the_server(open_session: OpenSession, server: DaqServer) -> None:
    session = driving(open_session(**INPUTS))
    faults: Any = server._faults
    calls: list[str] = []
    faults.strike = calls.append
    session.safety_inputs()
    assert calls == ["ReadDigitalLines"]


@pytest.mark.parametrize("code", [-200279, -200284, -88709, -201003])
def test_a_read_that_fails_ends_the_run_and_says_nothing_of_any_contact(
    open_session: OpenSession, server: DaqServer, plant: Loopback, code: int
) -> None:
    session = driving(open_session(**INPUTS))
    server.fail_next("ReadDigitalLines", code)
    with pytest.raises(RigError, match="reading the safety inputs") as caught:
        session.safety_inputs()
    assert caught.value.code == code
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize("good", ["high", "low"])
def test_a_line_that_the_device_does_not_report_is_open(
    open_session: OpenSession, contacts: Contacts, good: str
) -> None:
    contacts.levels = dict.fromkeys(contacts.levels, good == "high")
    session = driving(open_session(**{name: {"good": good} for name in LINES}))
    hidden: Any = session
    hidden._tasks.safety._reader.read_one_sample_one_line = lambda data, timeout: None  # noqa: ARG005
    assert session.safety_inputs() == dict.fromkeys(NAMES, False)


def test_a_server_that_stalls_ends_it_too(open_session: OpenSession, server: DaqServer, plant: Loopback) -> None:
    session = driving(open_session(emergency_stop={}, timeout_margin=0.1))
    server.stall(0.8)
    with pytest.raises(RigError, match="DEADLINE_EXCEEDED"):
        session.safety_inputs()
    # what was asked is done when it answers again
    eventually(lambda: is_safe(plant))


def test_the_lines_are_free_between_runs_as_the_start_of_a_watchdog_needs(
    open_session: OpenSession, server: DaqServer
) -> None:
    session = open_session(**INPUTS, watchdog=2.0, heartbeat={})
    hidden: Any = server
    for _ in range(2):
        assert session.safety_inputs() == dict.fromkeys(NAMES, True)
        driving(session)
        assert session.safety_inputs() == dict.fromkeys(NAMES, True)
        session.stop()
        assert not set(hidden._driver._reserved) & {*LINES.values(), HEARTBEAT}


def test_they_can_be_read_while_another_thread_ends_the_run(
    open_session: OpenSession, plant: Loopback, contacts: Contacts
) -> None:
    session = driving(open_session(**INPUTS, heartbeat={}))
    over = threading.Event()
    seen: list[dict[str, bool]] = []

    def look() -> None:
        while not over.is_set():
            seen.append(session.safety_inputs())

    thread = threading.Thread(target=look)
    thread.start()
    eventually(lambda: len(seen) > 5)
    assert session.cut()
    session.stop()
    assert is_safe(plant)
    over.set()
    thread.join()
    assert all(all(one.values()) for one in seen)
    # nothing of it is left over for the next run
    driving(session)
    contacts.levels[LINES["over_travel"]] = False
    assert not session.safety_inputs()["over-travel"]


class TestAnAmplifierThatIsReadyOnlyWhenEnabled:
    @pytest.fixture
    def session(self, open_session: OpenSession, contacts: Contacts, plant: Loopback) -> DaqSession:
        contacts.levels.pop(LINES["amplifier_ready"])

        class Follows(dict[str, bool]):
            def __missing__(self, line: str) -> bool:
                return plant.enabled

        contacts.levels = Follows(contacts.levels)
        return open_session(**(INPUTS | {"amplifier_ready": {"delay": 0.3}}))

    def test_is_asked_only_then(self, session: DaqSession) -> None:
        assert session.safety_inputs() == dict.fromkeys(NAMES[:3], True)
        driving(session)
        assert session.safety_inputs() == dict.fromkeys(NAMES, True)
        session.cut()
        assert session.safety_inputs() == dict.fromkeys(NAMES[:3], True)

    def test_refuses_the_run_when_it_does_not_come(
        self, session: DaqSession, contacts: Contacts, plant: Loopback
    ) -> None:
        contacts.levels[LINES["amplifier_ready"]] = False
        with pytest.raises(RigError, match=r"open 0\.3 s after the enable line was closed: amplifier ready"):
            session.prepare()
        assert plant.ever_enabled
        eventually(lambda: is_safe(plant))

    def test_is_not_waited_for_after_a_cut(self, session: DaqSession, contacts: Contacts, plant: Loopback) -> None:
        contacts.levels[LINES["amplifier_ready"]] = False
        cut = threading.Timer(0.1, session.cut)
        cut.start()
        with pytest.raises(RigError, match="enable line was cut"):
            session.prepare()
        cut.join()
        assert is_safe(plant)


def test_a_session_says_what_is_wired_and_what_is_not(open_session: OpenSession) -> None:
    told = open_session(emergency_stop={}, over_travel={"good": "low"}).description
    assert told["emergency stop"] == "Dev1/port0/line1, high is good"
    assert told["over-travel"] == "Dev1/port0/line2, low is good"
    assert "over-travel 2" not in told
    assert told["amplifier ready"].startswith("not wired")
    assert told["heartbeat"] == "none"


@pytest.mark.parametrize(
    ("daq", "item", "remedy"),
    [
        ({"emergency_stop": {"line": "Dev1/port0/LINE0"}}, "emergency_stop.line", "enable_line already uses this line"),
        ({"over_travel": {"line": "/Dev1/port0/line3"}, "over_travel_2": {}}, "over_travel_2.line", "over_travel.line"),
        ({"amplifier_ready": {"line": "Dev1/port0/line5"}, "heartbeat": {}}, "heartbeat.line", "amplifier_ready.line"),
        ({"heartbeat": {}, "enable_line": None}, "heartbeat.line", "requires enable_line"),
    ],
)
def test_a_line_has_one_use(daq: dict[str, Any], item: str, remedy: str) -> None:
    with pytest.raises(ValueError, match="line") as caught:
        Daq(**daq)
    error = caught.value.errors()[0]["ctx"]["error"]
    assert isinstance(error, InvalidInput)
    assert error.item == item
    assert remedy in error.allowed


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("Dev1/port0/line99", r"has no such digital input line; it has Dev1/port0/line0 to Dev1/port0/line31"),
        ("Dev2/port0/line1", "no device Dev2 exists"),
    ],
)
def test_a_line_that_is_not_there_is_refused_by_name(open_session: OpenSession, line: str, says: str) -> None:
    with pytest.raises(InvalidInput, match=says) as caught:
        open_session(emergency_stop={"line": line})
    assert caught.value.item == "hardware.daq.emergency_stop.line"


def test_a_device_without_digital_inputs_is_refused(plant: Loopback) -> None:
    relays = "cRIO1Mod4/port0/line{}"
    with DaqServer(plant, compact_rio()) as server:
        daq = Daq(
            server=server.address,
            output="cRIO1Mod3/ao0",
            enable_line=relays.format(0),
            emergency_stop=EmergencyStop(line=relays.format(1)),
        )
        with pytest.raises(InvalidInput, match=r"NI 9485.*it has none") as caught:
            DaqSession(daq, (AnalogInput(terminal="cRIO1Mod1/ai0"),), RATE, 100)
    assert caught.value.item == "hardware.daq.emergency_stop.line"


def test_a_session_that_fails_to_open_leaves_no_task(open_session: OpenSession, server: DaqServer) -> None:
    for call in ("CreateDIChan", "CreateAIVoltageChan"):
        server.fail_next(call, -200077)
        with pytest.raises(RigError):
            open_session(**INPUTS, heartbeat={})
    assert open_session(**INPUTS, heartbeat={}).description["tasks left by another client"] == "none"


def test_the_values_of_a_run_are_not_disturbed(open_session: OpenSession) -> None:
    session = started(open_session(**INPUTS, heartbeat={}), np.zeros(round(RATE)))
    for _ in range(3):
        assert session.read(BLOCK).shape == (BLOCK, 4)
        session.safety_inputs()
        session.write(np.zeros(BLOCK))
