"""Devices by name: the rules of NI's documents, through the real client."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from nidaqmx.constants import Level, OutputDataTransferCondition, TaskMode, WatchdogAOExpirState
from nidaqmx.errors import DaqError
from nidaqmx.system.watchdog import AOExpirationState, DOExpirationState
from numpy.typing import NDArray

from drivers.emulation.daqmx.conversion import conversion_period
from drivers.emulation.daqmx.zoo import NAMES, build
from sim.errors import InvalidInput
from tests.drivers.emulation.daqmx_loopback import LSB, RATE, Desk
from tests.patience import eventually

FILTER = 40.0 + 5.0 / 512.0
TICK = 1.0 / RATE


def desk(device: str, *modules: str, **more: Any) -> Desk:
    return Desk(build(device, modules), **more)


def code(error: pytest.ExceptionInfo[DaqError]) -> int:
    return int(error.value.error_code)


def lateness(desk: Desk, channels: Sequence[str], limit: float = 10.0) -> NDArray[np.float64]:
    """How many ticks later than in the first channel the same signal appears in each; terminal 1 shows the tick."""
    task = desk.inputs(", ".join(channels), limit=limit)
    task.start()
    volts = np.array(task.read(200, 20.0))[:, 100:]
    return (volts[0] - volts).mean(axis=1) / LSB


@pytest.mark.parametrize("name", NAMES)
def test_every_device_has_inputs_an_output_and_lines(name: str) -> None:
    with Desk(build(name)) as one:
        devices = list(one.system.devices)
        assert any(device.ai_physical_chans.channel_names for device in devices)
        assert any(device.ao_physical_chans.channel_names for device in devices)
        assert any(device.do_lines.channel_names for device in devices)
        assert any(device.di_lines.channel_names for device in devices)


@pytest.mark.parametrize(
    ("device", "modules", "item"),
    [
        ("USB-6363-OEM", (), "--device"),
        ("cDAQ-9174", ("9999",), "--modules"),
        ("cDAQ-9174", ("9205", "9263", "9401", "9485", "9239"), "--modules"),
        ("PCIe-6351", ("9205",), "--modules"),
    ],
)
def test_what_cannot_be_built_is_refused_by_name(device: str, modules: tuple[str, ...], item: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        build(device, modules)
    assert caught.value.item == item


@pytest.mark.parametrize(
    ("device", "terminal"),
    [
        ("cDAQ-9174", "/cDAQ1/te0/SampleClock"),
        ("cDAQ-9185", "/cDAQ1/te0/SampleClock"),
        ("cRIO-9049", "/cRIO1/it0/SampleClock"),
    ],
)
def test_chassis_name_their_engines_differently(device: str, terminal: str) -> None:
    with desk(device, "9205") as one:
        task = one.inputs(f"{terminal.split('/')[1]}Mod1/ai0")
        with pytest.raises(DaqError) as error:
            str(task.timing.samp_clk_term)
        assert code(error) == -200983
        task.control(TaskMode.TASK_RESERVE)
        assert task.timing.samp_clk_term == terminal


@pytest.mark.parametrize(
    ("modules", "asked", "made"),
    [
        (("9239",), 2000.0, 50e3 / 25),
        (("9239",), 2001.0, 50e3 / 24),
        (("9239",), 1000.0, 50e3 / 31),
        (("9239",), 50e3, 50e3),
        (("9234",), 2000.0, 51.2e3 / 25),
        (("9234",), 1000.0, 51.2e3 / 31),
        # the faster of two timebases serves both
        (("9239", "9234"), 2000.0, 51.2e3 / 25),
        (("9215",), 2000.0, 2000.0),
    ],
)
def test_a_delta_sigma_module_has_few_rates(modules: tuple[str, ...], asked: float, made: float) -> None:
    with desk("cDAQ-9174", *modules) as one:
        channels = ", ".join(f"cDAQ1Mod{slot}/ai0" for slot in range(1, len(modules) + 1))
        task = one.inputs(channels, rate=asked, limit=5.0)
        assert task.timing.samp_clk_rate == pytest.approx(made, rel=1e-12)


def test_a_rate_above_the_highest_is_refused() -> None:
    with desk("cDAQ-9174", "9239") as one, pytest.raises(DaqError) as error:
        one.inputs("cDAQ1Mod1/ai0", rate=50_001.0)
    assert code(error) == -200077


def test_filters_delay_by_their_number_of_samples() -> None:
    with desk("cDAQ-9174", "9215", "9239") as one:
        late = lateness(one, ["cDAQ1Mod1/ai1", "cDAQ1Mod2/ai1"])
    assert late[1] == pytest.approx(FILTER + 3.3e-6 / TICK, abs=0.005)


def test_a_multiplexer_pads_its_conversions() -> None:
    with desk("PCIe-6351") as one:
        assert one.inputs("Dev1/ai0:3").timing.ai_conv_rate == pytest.approx(1.0 / 11e-6)


@pytest.mark.parametrize(
    ("rate", "channels", "period"), [(2000.0, 4, 14e-6), (2000.0, 1, 4e-6), (2000.0, 32, 14e-6), (20_000.0, 4, 12.5e-6)]
)
def test_the_padding_of_a_multiplexer_ends_where_the_sample_does(rate: float, channels: int, period: float) -> None:
    assert conversion_period(4e-6, channels, rate) == pytest.approx(period)


def test_the_conversion_rate_belongs_to_a_device_of_the_task() -> None:
    with desk("cDAQ-9174", "9205", "9215") as one:
        task = one.inputs("cDAQ1Mod1/ai0:1, cDAQ1Mod2/ai0")
        assert task.timing["cDAQ1Mod1"].ai_conv_rate == pytest.approx(1.0 / 14e-6)
        for query in (lambda: task.timing["cDAQ1Mod2"].ai_conv_rate, lambda: task.timing.ai_conv_rate):
            with pytest.raises(DaqError) as error:
                query()
            assert code(error) == -200452


def test_the_lines_of_a_nibble_have_one_direction() -> None:
    with desk("cDAQ-9174", "9401") as one:
        output, same, other = one.task("do"), one.task("same"), one.task("other")
        output.do_channels.add_do_chan("cDAQ1Mod1/port0/line0")
        same.di_channels.add_di_chan("cDAQ1Mod1/port0/line3")
        other.di_channels.add_di_chan("cDAQ1Mod1/port0/line4")
        output.write(True)
        assert other.read() in (False, True)
        with pytest.raises(DaqError) as error:
            same.read()
        assert code(error) == -200587


@pytest.mark.parametrize(("device", "settable"), [("PCIe-6351", True), ("USB-6351", False)])
def test_only_some_outputs_have_a_transfer_condition(device: str, settable: bool) -> None:
    with desk(device) as one:
        (channel,) = one.output().ao_channels
        condition = OutputDataTransferCondition.ON_BOARD_MEMORY_HALF_FULL_OR_LESS
        if settable:
            channel.ao_data_xfer_req_cond = condition
            assert channel.ao_data_xfer_req_cond is condition
            return
        with pytest.raises(DaqError) as error:
            channel.ao_data_xfer_req_cond = condition
        assert code(error) == -200452


class TestChassisWatchdog:
    RELAY = "cDAQ1Mod3/port0/line0"

    def armed(self, one: Desk, timeout: float) -> Any:
        watchdog, line, output = one.watchdog(timeout, "cDAQ1"), one.task("do"), one.task("ao")
        watchdog.cfg_watchdog_do_expir_states([DOExpirationState(self.RELAY, Level.LOW)])
        watchdog.cfg_watchdog_ao_expir_states([AOExpirationState("cDAQ1Mod2/ao0", 0.0, WatchdogAOExpirState.VOLTAGE)])
        watchdog.expir_trig_trig_on_network_conn_loss = True
        watchdog.start()
        line.do_channels.add_do_chan(self.RELAY)
        line.write(True)
        output.ao_channels.add_ao_voltage_chan("cDAQ1Mod2/ao0")
        output.write(3.0, auto_start=True)
        assert one.plant.enabled
        assert one.plant.output == 3.0
        return line

    def desk(self) -> Desk:
        return desk("cDAQ-9185", "9205", "9263", "9485", drive="cDAQ1Mod2/ao0")

    def test_a_module_has_none(self) -> None:
        with self.desk() as one, pytest.raises(DaqError) as error:
            one.watchdog(1.0, "cDAQ1Mod3")
        assert code(error) == -200662

    @pytest.mark.parametrize("way", ["silence", "network"])
    def test_it_sets_every_output_and_bars_the_chassis_until_it_is_reset(self, way: str) -> None:
        with self.desk() as one:
            line = self.armed(one, 0.5 if way == "silence" else 30.0)
            if way == "network":
                one.server.lose_network()
            eventually(lambda: not one.plant.enabled)
            assert one.plant.output == 0.0
            for attempt in (
                lambda: line.write(True),
                lambda: one.inputs("cDAQ1Mod1/ai0").start(),
            ):
                with pytest.raises(DaqError) as error:
                    attempt()
                assert code(error) == -201478
            one.system.devices["cDAQ1"].reset_device()
            again = one.task("again")
            again.do_channels.add_do_chan(self.RELAY)
            again.write(True)
            assert one.plant.enabled

    def test_nothing_else_on_the_chassis_may_be_reserved_when_it_starts(self) -> None:
        with self.desk() as one:
            one.inputs("cDAQ1Mod1/ai0").control(TaskMode.TASK_RESERVE)
            with pytest.raises(DaqError) as error:
                one.watchdog(1.0, "cDAQ1").start()
            assert code(error) == -201477

    def test_a_chassis_at_a_usb_port_has_none(self) -> None:
        with desk("cDAQ-9174", "9485") as one, pytest.raises(DaqError) as error:
            one.watchdog(1.0, "cDAQ1")
        assert code(error) == -200662
