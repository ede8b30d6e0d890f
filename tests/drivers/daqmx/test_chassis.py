"""A chassis with modules: its watchdog, and the directions of an NI 9401."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from drivers.daqmx.devices import find_devices
from drivers.daqmx.parameters import AnalogInput, Daq, EmergencyStop, OverTravel
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.daqmx.zoo import build
from drivers.errors import ConnectionLost, RigError
from sim.errors import InvalidInput
from sim.sensors import Converter
from tests.drivers.daqmx.conftest import LEAD, RATE, closed_whatever_it_says
from tests.drivers.daqmx.loopback import BITS, RANGE, Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe
from tests.patience import eventually

MODULES = ("9205", "9263", "9485", "9401")
INPUTS = (AnalogInput(terminal="cDAQ1Mod1/ai0"),)


@pytest.fixture
def plant() -> Loopback:
    return Loopback(RATE)


@pytest.fixture
def server(plant: Loopback) -> Iterator[DaqServer]:
    converter = Converter(bits=BITS, range=RANGE)
    devices = build("cDAQ-9185", MODULES)
    relay = "cDAQ1Mod3/port0/line0"
    with DaqServer(plant, devices, converter=converter, drive="cDAQ1Mod2/ao0", enable_line=relay) as server:
        yield server


@contextmanager
def opened(server: DaqServer, **daq: Any) -> Iterator[DaqSession]:
    wired = {"output": "cDAQ1Mod2/ao0", "enable_line": "cDAQ1Mod3/port0/line0", "watchdog": 1.0} | daq
    session = DaqSession(Daq(server=server.address, **wired), INPUTS, RATE, LEAD)
    try:
        yield session
    finally:
        closed_whatever_it_says(session)


def test_modules_name_their_chassis() -> None:
    for device, chassis in (("cDAQ-9174", "cDAQ1"), ("cRIO-9049", "cRIO1")):
        with DaqServer(Loopback(RATE), build(device, ("9205", "9263"))) as server:
            assert [one.chassis for one in find_devices(server.address)] == [None, chassis, chassis]


def test_a_run_keeps_the_watchdog_of_the_chassis_quiet(server: DaqServer, plant: Loopback) -> None:
    with opened(server) as session:
        driving(session)
        for _ in range(30):
            session.write(np.full(BLOCK, 3.0))
            session.read(BLOCK)
        assert plant.enabled
        session.stop()
        eventually(lambda: is_safe(plant))


@pytest.mark.parametrize("way", ["silence", "network"])
def test_an_expiry_opens_the_relay_sets_the_output_to_zero_and_needs_a_new_session(
    server: DaqServer, plant: Loopback, way: str
) -> None:
    with opened(server, watchdog=1.0 if way == "silence" else 30.0) as session:
        driving(session)
        if way == "network":
            server.lose_network()
        # at once, or after its second: long before the time-out of the other case
        eventually(lambda: not plant.enabled)
        # the output too, at its next tick: after the samples that wait, it would hold their 3 V
        assert plant.next_output() == 0.0
        assert session.cut() is True
        with pytest.raises(RigError):
            session.read(BLOCK)
        closed_whatever_it_says(session)
        eventually(lambda: is_safe(plant))
    with opened(server) as session:
        driving(session)
        assert plant.enabled


def test_the_chassis_is_reset_once_and_the_next_run_is_refused(server: DaqServer, plant: Loopback) -> None:
    with opened(server) as session:
        driving(session)
        eventually(lambda: not plant.enabled)
        with pytest.raises(RigError) as caught:
            session.write(np.zeros(BLOCK))
        assert any("chassis was reset" in note for note in caught.value.__notes__)
        session.stop()
        with pytest.raises(ConnectionLost, match="open a new session"):
            session.prepare()
        assert is_safe(plant)


def test_a_program_that_died_leaves_an_expired_chassis_that_the_next_one_resets(
    server: DaqServer, plant: Loopback
) -> None:
    with opened(server) as dead:
        driving(dead)
        eventually(lambda: not plant.enabled)
        with opened(server) as session:
            driving(session)
            assert plant.enabled


@pytest.mark.parametrize("device", ["cDAQ-9174", "cRIO-9045"])
def test_a_chassis_without_watchdog_is_named(device: str) -> None:
    name = "cDAQ1" if device.startswith("cDAQ") else "cRIO1"
    with DaqServer(Loopback(RATE), build(device, MODULES)) as server:
        daq = Daq(server=server.address, output=f"{name}Mod2/ao0", enable_line=f"{name}Mod3/port0/line0", watchdog=1.0)
        with pytest.raises(InvalidInput, match=f"{name} has no watchdog"):
            DaqSession(daq, (AnalogInput(terminal=f"{name}Mod1/ai0"),), RATE, LEAD)


class TestNibbles:
    LINES = "cDAQ1Mod4/port0/line{}"

    def wired(self, enable: int, *contacts: int) -> dict[str, Any]:
        kinds = {"emergency_stop": EmergencyStop, "over_travel": OverTravel}
        lines = dict(zip(kinds, contacts, strict=False))
        inputs = {name: kinds[name](line=self.LINES.format(line), good="low") for name, line in lines.items()}
        return {"enable_line": self.LINES.format(enable), "watchdog": None, **inputs}

    @pytest.mark.parametrize(("enable", "contact", "free"), [(0, 1, "4 to 7"), (4, 7, "0 to 3"), (3, 0, "4 to 7")])
    def test_outputs_and_inputs_in_one_half_are_refused_in_plain_words(
        self, server: DaqServer, enable: int, contact: int, free: str
    ) -> None:
        with (
            pytest.raises(InvalidInput, match=f"one direction.*enable_line is an output.*lines {free}") as caught,
            opened(server, **self.wired(enable, contact)),
        ):
            pass
        assert caught.value.item == "hardware.daq.emergency_stop.line"

    def test_each_direction_in_its_own_half_works(self, server: DaqServer) -> None:
        with opened(server, **self.wired(0, 4, 5)) as session:
            session.prepare()
            assert session.safety_inputs() == {"emergency stop": True, "over-travel": True}
