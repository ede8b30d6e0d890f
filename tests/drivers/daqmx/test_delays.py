"""Delays of inputs as the driver reads or knows them, against emulated devices that have them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.daqmx.zoo import build
from drivers.timebase.deskew import Deskew
from sim.errors import InvalidInput
from sim.sensors import Converter
from tests.drivers.daqmx.conftest import LEAD, RATE
from tests.drivers.daqmx.loopback import BITS, RANGE, Loopback

SAMPLES = 40.0 + 5.0 / 512.0


@contextmanager
def session_on(devices: Sequence[DeviceModel], terminals: Sequence[str], rate: float = RATE) -> Iterator[DaqSession]:
    chassis = len(devices) > 1
    output = next(name for device in devices for name in device.output_names)
    server = DaqServer(Loopback(rate), devices, converter=Converter(bits=BITS, range=RANGE), drive=output)
    with server:
        daq = Daq(server=server.address, output=output, enable_line=None if chassis else "Dev1/port0/line0")
        inputs = [AnalogInput(terminal=terminal, range=5.0) for terminal in terminals]
        with DaqSession(daq, inputs, rate, LEAD) as session:
            yield session


def ramp_of(session: DaqSession, n: int = 400) -> np.ndarray:
    """Volts of all inputs, whose terminals show a steep ramp at the output, without the offsets of the terminals."""
    volts = np.linspace(-4.0, 4.0, n + LEAD)
    session.prepare()
    session.write(volts)
    session.start()
    counts = session.read(n).astype(float)
    for k, scaling in enumerate(session.scalings):
        counts[:, k] = scaling.coefficients[0] + scaling.coefficients[1] * counts[:, k]
    return counts


def test_the_instants_of_a_multiplexer_are_read_from_the_device() -> None:
    terminals = [f"Dev1/ai{k}" for k in range(4)]
    with session_on(build("PCIe-6351"), terminals) as session:
        assert [one.seconds for one in session.delays] == pytest.approx([0.0, -11e-6, -22e-6, -33e-6])
        assert all(one.uncertainty < 1e-6 for one in session.delays)
        offsets = 10.0 * 2.0 * RANGE / 2**BITS * np.arange(4)
        volts = ramp_of(session)[100:] - offsets
    slope = 8.0 / (399 + LEAD) * RATE
    late = (volts[:, :1] - volts).mean(axis=0) / slope
    assert late == pytest.approx([0.0, -11e-6, -22e-6, -33e-6], abs=5e-6)


def test_two_modules_in_one_task_have_each_their_own() -> None:
    terminals = ["cDAQ1Mod1/ai0", "cDAQ1Mod2/ai0", "cDAQ1Mod1/ai1", "cDAQ1Mod3/ai0"]
    with session_on(build("cDAQ-9174", ("9205", "9239", "9215", "9263")), terminals) as session:
        found = [one.seconds for one in session.delays]
    assert found == pytest.approx([0.0, SAMPLES / RATE + 3.3e-6, -14e-6, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("module", "rate", "constant", "uncertainty", "source"),
    [
        ("9239", 2000.0, 3.3e-6, 1e-6, "specifications of"),
        ("9234", 2048.0, 2.6e-6, 5e-6, "assumed from related modules of"),
    ],
)
def test_a_filter_without_a_property_has_its_known_delay(
    module: str, rate: float, constant: float, uncertainty: float, source: str
) -> None:
    with session_on(build("cDAQ-9174", (module, "9263")), ["cDAQ1Mod1/ai0"], rate) as session:
        (delay,) = session.delays
        assert delay.seconds == pytest.approx(SAMPLES / rate + constant, abs=1e-9)
        assert delay.uncertainty == uncertainty
        assert delay.source == f"{source} the NI {module}"


def test_a_filter_with_properties_is_read_and_not_removed_by_the_device() -> None:
    chassis, module, output = build("cDAQ-9174", ("9239", "9263"))
    assert module.inputs is not None
    assert module.inputs.delta_sigma is not None
    # a module that no table knows
    converter = replace(module.inputs.delta_sigma, samples=12.5, seconds=0.0, readable=True)
    module = replace(module, product="NI 9999", inputs=replace(module.inputs, delta_sigma=converter))
    with session_on((chassis, module, output), ["cDAQ1Mod1/ai0"]) as session:
        (delay,) = session.delays
        assert delay.seconds == pytest.approx(12.5 / RATE)
        assert delay.source == "AI.FilterDelay"
        volts = ramp_of(session)[100:, 0]
    expected = np.interp(np.arange(100, 400) - 12.5, np.arange(400), np.linspace(-4.0, 4.0, 400 + LEAD)[:400])
    assert volts == pytest.approx(expected, abs=1e-3)


def test_a_module_that_nobody_knows_says_so() -> None:
    chassis, module, output = build("cDAQ-9174", ("9239", "9263"))
    with session_on((chassis, replace(module, product="NI 9999"), output), ["cDAQ1Mod1/ai0"]) as session:
        (delay,) = session.delays
        assert delay.uncertainty == np.inf
        assert "unknown" in session.description["input delays"]


def test_the_skew_of_two_modules_is_gone_within_a_microsecond() -> None:
    terminals = ["cDAQ1Mod1/ai0", "cDAQ1Mod2/ai0"]
    with session_on(build("cDAQ-9174", ("9205", "9239", "9263")), terminals) as session:
        delays = [one.seconds for one in session.delays]
        rails = [(scaling.lowest, scaling.highest) for scaling in session.scalings]
        deskew = Deskew(delays, RATE, rails)
        volts = np.linspace(-4.0, 4.0, 700)
        session.prepare()
        session.write(volts)
        session.start()
        raw = session.read(deskew.missing(400))
        moved = deskew.moved(raw)
    scale = [scaling.coefficients[1] for scaling in session.scalings]
    slope = 8.0 / 699 * RATE
    before, after = raw[100:400] * scale, moved[100:] * scale
    assert (before[:, 0] - before[:, 1]).mean() / slope == pytest.approx(delays[1], abs=5e-6)
    assert (after[:, 0] - after[:, 1]).mean() / slope == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("module", "rate", "made"), [("9239", 2001.0, "2083"), ("9234", 2000.0, "2048")])
def test_a_rate_that_a_delta_sigma_module_rounds_is_refused_with_the_one_it_makes(
    module: str, rate: float, made: str
) -> None:
    with (
        pytest.raises(InvalidInput, match=made) as caught,
        session_on(build("cDAQ-9174", (module, "9263")), ["cDAQ1Mod1/ai0"], rate),
    ):
        pass
    assert caught.value.item == "sample_rate"
