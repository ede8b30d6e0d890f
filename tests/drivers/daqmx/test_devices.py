"""What there is, as the data sheets of the emulated devices say; and a chassis with modules."""

import numpy as np
import pytest

from drivers.daqmx.devices import FoundDevice, find_devices
from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import DeviceNotFound
from sim.sensors import Converter
from tests.drivers.daqmx.conftest import LEAD, RATE
from tests.drivers.daqmx.loopback import BITS, COUNTS_PER_VOLT, RANGE, Loopback
from tests.drivers.daqmx.others import Another
from tests.drivers.daqmx.runs import started


def test_a_multifunction_device_is_found() -> None:
    with DaqServer(Loopback(RATE), [x_series(simulated=True)]) as server:
        (found,) = find_devices(server.address)
    widths = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1)
    assert found == FoundDevice(
        name="Dev1",
        product="USB-6363",
        serial="01C0FFEE",
        simulated=True,
        inputs=tuple(f"Dev1/ai{k}" for k in range(32)),
        outputs=tuple(f"Dev1/ao{k}" for k in range(4)),
        lines=tuple(f"Dev1/port0/line{k}" for k in range(32)),
        input_lines=tuple(f"Dev1/port0/line{k}" for k in range(32)),
        input_ranges=tuple((-width, width) for width in widths),
        output_ranges=((-10.0, 10.0), (-5.0, 5.0)),
        input_rate=2.0e6,
        total_input_rate=1.0e6,
        simultaneous=False,
        output_rate=2.86e6,
    )
    assert found.identity == "USB-6363, serial number 01C0FFEE, simulated"


def test_a_chassis_and_its_modules_are_found() -> None:
    with DaqServer(Loopback(RATE), compact_rio()) as server:
        found = {device.name: device for device in find_devices(server.address)}
    assert list(found) == ["cRIO1", "cRIO1Mod1", "cRIO1Mod2", "cRIO1Mod3", "cRIO1Mod4", "cRIO1Mod5"]
    assert found["cRIO1"].input_rate is None
    assert found["cRIO1"].output_rate is None
    assert found["cRIO1Mod1"].simultaneous
    assert found["cRIO1Mod3"].outputs == tuple(f"cRIO1Mod3/ao{k}" for k in range(4))


def test_inputs_that_share_a_converter_share_its_rate() -> None:
    with DaqServer(Loopback(RATE), [x_series(), *compact_rio()]) as server:
        found = {device.name: device for device in find_devices(server.address)}
    assert found["Dev1"].highest_input_rate(1) == 1.0e6
    assert found["Dev1"].highest_input_rate(4) == 2.5e5
    assert found["cRIO1Mod1"].highest_input_rate(4) == 5.0e4
    assert found["cRIO1"].highest_input_rate(1) is None


def test_the_inputs_keep_the_engine_that_their_trigger_was_read_from() -> None:
    plant = Loopback(RATE, 8)
    inputs = [AnalogInput(terminal="cRIO1Mod1/ai0", wiring="differential")]
    with DaqServer(plant, compact_rio(), converter=Converter(bits=BITS, range=RANGE)) as server:
        daq = Daq(server=server.address, output="cRIO1Mod3/ao0", enable_line=None)
        with Another(server.address) as other, DaqSession(daq, inputs, RATE, LEAD) as session:
            # another program takes an engine after the session has chosen
            other.holds("engine")
            assert session.description["start trigger"] == "/cRIO1/it0/StartTrigger"
            with pytest.raises(DeviceNotFound, match="another program holds the device"):
                started(session)


def test_a_controller_with_24_bits_reads_what_it_plays_and_names_the_delay() -> None:
    plant = Loopback(RATE, 8)
    inputs = [AnalogInput(terminal=name, wiring="differential") for name in ("cRIO1Mod1/ai0", "cRIO1Mod2/ai3")]
    volts = 5.0 * np.sin(2.0 * np.pi * 20.0 * np.arange(LEAD + 200) / RATE)
    with DaqServer(plant, compact_rio(), converter=Converter(bits=BITS, range=RANGE)) as server:
        daq = Daq(server=server.address, output="cRIO1Mod3/ao0", enable_line="cRIO1Mod4/port0/line0")
        with DaqSession(daq, inputs, RATE, LEAD) as session:
            assert session.dtype is np.int32
            assert session.description["start trigger"] == "/cRIO1/it0/StartTrigger"
            assert "specifications of the NI 9239" in session.description["input delays"]
            session.prepare()
            session.write(volts)
            session.start()
            counts = session.read(200)
    assert counts.dtype == np.int32
    scaling = session.scalings[0]
    assert (scaling.lowest, scaling.highest, scaling.bits) == (-(2**23) + 1, 2**23 - 2, 32)
    late = session.delays[0].seconds
    assert late == pytest.approx((40.0 + 5.0 / 512.0) / RATE + 3.3e-6, abs=1e-9)
    # terminals 0 and 7 of the plant, which shows 16 bits with 10 counts more at each; the output is a staircase
    expected = np.interp(np.arange(50, 200) / RATE - late, np.arange(volts.size) / RATE, volts)
    got = counts[50:] * scaling.coefficients[1] - np.array([0.0, 70.0]) / COUNTS_PER_VOLT
    np.testing.assert_allclose(got, expected[:, np.newaxis] * [1.0, 1.0], atol=2.0 / COUNTS_PER_VOLT)
