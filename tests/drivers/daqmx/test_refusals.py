"""What a device cannot do is refused by name, and before anything is made."""

from typing import Any

import numpy as np
import pytest

from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import DeviceNotFound, RigError
from sim.errors import InvalidInput
from tests.drivers.daqmx.conftest import INPUTS, LEAD, RATE, OpenSession
from tests.drivers.daqmx.loopback import Loopback
from tests.drivers.daqmx.others import Another


@pytest.mark.parametrize(
    ("change", "item", "told"),
    [
        ({"output": "Dev7/ao0"}, "hardware.daq.output", "no device Dev7 exists; available: Dev1"),
        ({"output": "Dev1/ao4"}, "hardware.daq.output", "Dev1/ao0 to Dev1/ao3"),
        ({"output": "Dev1/ai0"}, "hardware.daq.output", "no such analogue output"),
        ({"enable_line": "Dev1/port9/line0"}, "hardware.daq.enable_line", "no such digital output line"),
        ({"inputs": (AnalogInput(terminal="Dev1/ai32"),)}, "terminal of an input", "Dev1/ai0 to Dev1/ai31"),
        ({"inputs": (AnalogInput(terminal="Dev1/ai0:3"),)}, "terminal of an input", "no such analogue input"),
        ({"inputs": (AnalogInput(terminal="Dev2/ai0"),)}, "terminal of an input", "no device Dev2 exists"),
        ({"inputs": (AnalogInput(range=30.0),)}, "range of input Dev1/ai0", "at most +-10 V"),
        (
            {"inputs": (AnalogInput(wiring="pseudodifferential"),)},
            "wiring of input Dev1/ai0",
            "differential, RSE, NRSE",
        ),
        ({"inputs": ()}, "inputs", "at least one"),
        # the data sheet: 2 MS/s for one channel, 1 MS/s for all together
        (
            {"rate": 251e3},
            "sample_rate",
            "the inputs of Dev1 (USB-6363) can be read at 250000/s at most (inputs in use: 4)",
        ),
        ({"rate": 2.9e6}, "sample_rate", "has a maximum rate of 2.86e+06/s"),
        ({"rate": 0.0}, "sample_rate", "greater than 0"),
        ({"lead": -1}, "lead", "0 or more"),
        ({"watchdog": 1.0, "enable_line": None}, "hardware.daq.watchdog", "hardware.daq.enable_line"),
    ],
)
def test_what_the_device_cannot_do_is_refused_before_any_task(
    server: DaqServer, open_session: OpenSession, change: dict[str, Any], item: str, told: str
) -> None:
    # any task that measures, plays or watches would fail with this instead
    for call in ("CreateAIVoltageChan", "CfgSampClkTiming", "CreateWatchdogTimerTaskEx"):
        server.fail_next(call, -200077)
    with pytest.raises(InvalidInput) as caught:
        open_session(**change)
    assert caught.value.item == item
    assert told in str(caught.value)


@pytest.mark.parametrize("change", [{"output": "dev1/AO0"}, {"inputs": (AnalogInput(terminal="DEV1/ai0"),)}])
def test_names_are_compared_as_the_driver_does(open_session: OpenSession, change: dict[str, Any]) -> None:
    assert open_session(**change).sample_rate == RATE


def test_a_rate_that_the_device_does_not_have_is_refused(open_session: OpenSession) -> None:
    # its clock is a fraction of 2000/s: the next higher rate to 900/s is 1000/s
    with pytest.raises(InvalidInput) as caught:
        open_session(rate=900.0)
    assert caught.value.item == "sample_rate"
    assert "1000.0/s" in str(caught.value)


def test_a_watchdog_that_the_device_does_not_have_is_refused() -> None:
    with DaqServer(Loopback(RATE), compact_rio()) as server:
        daq = Daq(server=server.address, output="cRIO1Mod3/ao0", enable_line="cRIO1Mod4/port0/line0", watchdog=1.0)
        with pytest.raises(InvalidInput, match="cRIO1 has no watchdog") as caught:
            DaqSession(daq, [AnalogInput(terminal="cRIO1Mod1/ai0")], RATE, LEAD)
        assert caught.value.item == "hardware.daq.watchdog"


def test_a_failing_constructor_leaves_nothing_behind(server: DaqServer, open_session: OpenSession) -> None:
    # relay and output are set twice: to make safe what another program left, and as tasks of this session
    once, twice = (
        ("CreateAIVoltageChan", "CfgSampClkTiming"),
        ("CreateAOVoltageChan", "CreateDOChan", "WriteDigitalLines"),
    )
    for call in (*once, *twice):
        for _ in range(1 if call in once else 2):
            server.fail_next(call, -200077)
        with pytest.raises(RigError, match="-200077"):
            open_session()
        # a task that was left would be found, cleared and named
        with open_session() as session:
            assert session.description["tasks left by another client"] == "none"


@pytest.mark.parametrize("kind", ["inputs", "output", "line"])
def test_a_device_that_another_program_holds_is_busy(server: DaqServer, open_session: OpenSession, kind: str) -> None:
    with Another(server.address) as another:
        another.holds(kind)

        def use() -> None:
            session = open_session()
            session.prepare()
            session.write(np.zeros(LEAD))
            session.start()

        with pytest.raises(DeviceNotFound, match="another program holds the device") as caught:
            use()
    assert caught.value.code == -50103


def test_two_devices_can_be_used_together() -> None:
    with DaqServer(Loopback(RATE, 8), [x_series("Dev1"), x_series("Dev2")]) as both:
        daq = Daq(server=both.address, output="Dev2/ao1")
        with DaqSession(daq, INPUTS, RATE, LEAD) as session:
            assert "device Dev1" in session.description
            assert "device Dev2" in session.description
