"""What the emulated devices say of themselves, and what they refuse before anything starts."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
import session_pb2
import session_pb2_grpc
from nidaqmx.constants import AcquisitionType, DataJustification, ProductCategory, TerminalConfiguration
from nidaqmx.errors import DaqError

from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from sim.errors import InvalidInput
from tests.drivers.emulation.daqmx_loopback import Desk, Wires


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk([x_series(), *compact_rio()]) as desk:
        yield desk


def test_the_devices_of_the_server_are_listed(desk: Desk) -> None:
    names = [device.name for device in desk.system.devices]
    assert names == ["Dev1", "cRIO1", "cRIO1Mod1", "cRIO1Mod2", "cRIO1Mod3", "cRIO1Mod4", "cRIO1Mod5"]
    assert desk.system.driver_version >= (23, 8)


def test_a_usb_device_has_what_its_data_sheet_says(desk: Desk) -> None:
    device: Any = desk.system.devices["Dev1"]
    assert device.product_type == "USB-6363"
    assert device.product_category is ProductCategory.X_SERIES_DAQ
    assert device.serial_num == 0x01C0FFEE
    assert not device.is_simulated
    assert device.ai_voltage_rngs[:4] == [-10.0, 10.0, -5.0, 5.0]
    assert device.ao_voltage_rngs == [-10.0, 10.0, -5.0, 5.0]
    assert (device.ai_max_single_chan_rate, device.ai_max_multi_chan_rate) == (2.0e6, 1.0e6)
    assert not device.ai_simultaneous_sampling_supported
    assert device.ao_max_rate == 2.86e6
    assert [channel.name for channel in device.ai_physical_chans][-1] == "Dev1/ai31"
    assert [channel.name for channel in device.ao_physical_chans] == [f"Dev1/ao{k}" for k in range(4)]
    assert device.do_lines[0].name == "Dev1/port0/line0"
    assert set(device.ai_physical_chans["ai0"].ai_term_cfgs) == {
        TerminalConfiguration.RSE,
        TerminalConfiguration.NRSE,
        TerminalConfiguration.DIFF,
    }


def test_a_controller_has_modules_that_are_devices(desk: Desk) -> None:
    controller: Any = desk.system.devices["cRIO1"]
    assert controller.product_category is ProductCategory.COMPACT_RIO_CHASSIS
    assert not controller.ai_physical_chans.channel_names
    module: Any = desk.system.devices["cRIO1Mod1"]
    assert module.product_category is ProductCategory.C_SERIES_MODULE
    assert module.ai_simultaneous_sampling_supported
    assert module.ai_physical_chans["ai0"].ai_term_cfgs == [TerminalConfiguration.DIFF]
    with pytest.raises(DaqError) as error:
        _ = module.ao_max_rate
    assert error.value.error_code == -200452


def test_a_simulated_device_says_so() -> None:
    with Desk([x_series("Sim1", simulated=True)]) as desk:
        assert desk.system.devices["Sim1"].is_simulated


def test_the_second_service_lists_them_too(desk: Desk) -> None:
    stub = session_pb2_grpc.SessionUtilitiesStub(desk.channel)
    found = stub.EnumerateDevices(session_pb2.EnumerateDevicesRequest()).devices
    assert [(device.name, device.model) for device in found][:2] == [("Dev1", "USB-6363"), ("cRIO1", "cRIO-9045")]


def test_an_input_channel_tells_its_converter(desk: Desk) -> None:
    channel = desk.inputs("Dev1/ai0").ai_channels[0]
    assert channel.ai_raw_samp_size == 16
    assert channel.ai_resolution == 16.0
    assert channel.ai_raw_samp_justification is DataJustification.RIGHT
    assert (channel.ai_min, channel.ai_max) == (-10.0, 10.0)


def test_calibration_polynomials_are_handed_out() -> None:
    bent = (0.001, 3.0e-4, 1.0e-12, -2.0e-17)
    model = x_series()
    assert model.inputs is not None
    model = replace(model, inputs=replace(model.inputs, polynomials={1: bent}))
    with Desk([model]) as desk:
        task = desk.inputs("Dev1/ai0:1")
        assert tuple(task.ai_channels["Dev1/ai1"].ai_dev_scaling_coeff) == bent
        assert len(task.ai_channels["Dev1/ai0"].ai_dev_scaling_coeff) == 2


@pytest.mark.parametrize(("asked", "made"), [(2000.0, 2000.0), (900.0, 1000.0), (600.0, 2000.0 / 3.0)])
def test_the_rate_that_is_made_can_be_read_back(desk: Desk, asked: float, made: float) -> None:
    assert desk.inputs("Dev1/ai0", rate=asked).timing.samp_clk_rate == pytest.approx(made, rel=1e-12)
    assert desk.output(rate=asked).timing.samp_clk_rate == pytest.approx(made, rel=1e-12)


def test_channels_share_the_converter_of_a_device_that_has_one(desk: Desk) -> None:
    assert desk.inputs("Dev1/ai0:3").timing.samp_clk_max_rate == 2.5e5


def code_of(error: pytest.ExceptionInfo[DaqError]) -> int:
    return int(error.value.error_code)


class TestRefused:
    @pytest.mark.parametrize(
        ("channel", "code"),
        [("Dev9/ai0", -200220), ("Dev1/ai32", -200170), ("Dev1/ao0", -200170), ("cRIO1/ai0", -200170)],
    )
    def test_inputs_that_are_not_there(self, desk: Desk, channel: str, code: int) -> None:
        with pytest.raises(DaqError) as error:
            desk.task("in").ai_channels.add_ai_voltage_chan(channel)
        assert code_of(error) == code

    @pytest.mark.parametrize(("channel", "code"), [("Dev9/ao0", -200220), ("Dev1/ao4", -200170)])
    def test_outputs_that_are_not_there(self, desk: Desk, channel: str, code: int) -> None:
        with pytest.raises(DaqError) as error:
            desk.task("out").ao_channels.add_ao_voltage_chan(channel)
        assert code_of(error) == code

    @pytest.mark.parametrize("line", ["Dev1/port0/line32", "Dev1/port1/line0"])
    def test_lines_that_are_not_there(self, desk: Desk, line: str) -> None:
        with pytest.raises(DaqError) as error:
            desk.task("do").do_channels.add_do_chan(line)
        assert code_of(error) == -200170

    def test_devices_that_are_not_there(self, desk: Desk) -> None:
        with pytest.raises(DaqError) as error:
            _ = desk.system.devices["Dev9"].product_type
        assert code_of(error) == -200220

    @pytest.mark.parametrize(("low", "high"), [(-20.0, 20.0), (0.0, 10.1), (1.0, 1.0), (5.0, -5.0)])
    def test_limits_beyond_the_ranges(self, desk: Desk, low: float, high: float) -> None:
        with pytest.raises(DaqError) as error:
            desk.task("in").ai_channels.add_ai_voltage_chan("Dev1/ai0", min_val=low, max_val=high)
        assert code_of(error) == -200077
        with pytest.raises(DaqError) as error:
            desk.task("out").ao_channels.add_ao_voltage_chan("Dev1/ao0", min_val=low, max_val=high)
        assert code_of(error) == -200077

    def test_wirings_that_an_input_has_not(self, desk: Desk) -> None:
        with pytest.raises(DaqError) as error:
            desk.task("in").ai_channels.add_ai_voltage_chan(
                "cRIO1Mod1/ai0", terminal_config=TerminalConfiguration.RSE, min_val=-10.0, max_val=10.0
            )
        assert code_of(error) == -200077

    @pytest.mark.parametrize("rate", [0.0, 2.6e5])
    def test_rates_that_the_device_has_not(self, desk: Desk, rate: float) -> None:
        with pytest.raises(DaqError) as error:
            desk.inputs("Dev1/ai0:3", rate=rate)
        assert code_of(error) == -200077

    def test_another_kind_of_channel_in_the_same_task(self, desk: Desk) -> None:
        task = desk.inputs()
        with pytest.raises(DaqError) as error:
            task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
        assert code_of(error) == -200559

    def test_a_task_without_channels(self, desk: Desk) -> None:
        task = desk.task("empty")
        with pytest.raises(DaqError) as error:
            task.start()
        assert code_of(error) == -200478
        with pytest.raises(DaqError) as error:
            task.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        assert code_of(error) == -200478

    def test_changes_while_it_runs(self, desk: Desk) -> None:
        task = desk.inputs()
        task.start()
        with pytest.raises(DaqError) as error:
            task.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        assert code_of(error) == -200479
        with pytest.raises(DaqError) as error:
            task.start()
        assert code_of(error) == -200479

    @pytest.mark.parametrize("wrong", [{"drive": "Dev1/ao7"}, {"enable_line": "Dev1/port9/line0"}])
    def test_wires_to_terminals_that_are_not_there(self, wrong: dict[str, str]) -> None:
        with pytest.raises(InvalidInput):
            DaqServer(Wires(), [x_series()], **wrong)
