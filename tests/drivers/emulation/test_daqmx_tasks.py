"""Sessions, reservations and resets: what one client leaves is what the next one finds."""

from collections.abc import Iterator

import grpc
import nidaqmx
import numpy as np
import pytest
import session_pb2
import session_pb2_grpc
from nidaqmx.constants import LineGrouping
from nidaqmx.errors import DaqError, RpcError
from nidaqmx.stream_readers import DigitalMultiChannelReader, DigitalSingleChannelReader
from nidaqmx.stream_writers import DigitalMultiChannelWriter

from tests.drivers.emulation.daqmx_loopback import ATTACH, Desk, counts, staircase, write


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk(speed=2.0) as desk:
        yield desk


def test_a_name_is_given_once(desk: Desk) -> None:
    desk.task("in")
    with pytest.raises(RpcError) as error:
        desk.task("in")
    assert error.value.rpc_code is grpc.StatusCode.ALREADY_EXISTS


def test_a_task_that_nobody_has_cannot_be_attached(desk: Desk) -> None:
    with pytest.raises(RpcError) as error:
        desk.task("in", ATTACH)
    assert error.value.rpc_code is grpc.StatusCode.FAILED_PRECONDITION


def test_without_a_name_every_task_is_a_new_one(desk: Desk) -> None:
    tasks = [nidaqmx.Task(grpc_options=desk.options()) for _ in range(3)]
    assert len({task.name for task in tasks}) == 3
    for task in tasks:
        task.close()


def test_another_client_finds_the_task_and_may_close_it(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    with grpc.insecure_channel(desk.server.address) as channel:
        options = nidaqmx.GrpcSessionOptions(channel, "in", initialization_behavior=ATTACH)
        other = nidaqmx.Task("in", grpc_options=options)
        assert other.channels.channel_names == [f"Dev1/ai{k}" for k in range(4)]
        other.close()
    with pytest.raises(DaqError) as error:
        counts(task, 10)
    assert error.value.error_code == -200088


def test_the_tasks_of_a_client_that_is_gone_stay_and_go_on(desk: Desk) -> None:
    gone = grpc.insecure_channel(desk.server.address)
    options = nidaqmx.GrpcSessionOptions(gone, "out", initialization_behavior=1)
    task = nidaqmx.Task("out", grpc_options=options)
    task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
    task.write(2.5)
    gone.close()
    # NI's client does not notice
    task._close_on_exit = False
    assert desk.plant.output == 2.5
    blocked = desk.task("zero")
    blocked.ao_channels.add_ao_voltage_chan("Dev1/ao0")
    with pytest.raises(DaqError) as error:
        blocked.write(0.0)
    assert error.value.error_code == -50103
    desk.task("out", ATTACH).close()
    blocked.write(0.0)
    assert desk.plant.output == 0.0


class TestReservations:
    def test_the_inputs_have_one_clock(self, desk: Desk) -> None:
        desk.inputs("Dev1/ai0").start()
        other = desk.task("in2")
        other.ai_channels.add_ai_voltage_chan("Dev1/ai5")
        with pytest.raises(DaqError) as error:
            other.start()
        assert error.value.error_code == -50103

    def test_the_outputs_have_one_clock(self, desk: Desk) -> None:
        first, second = desk.output("Dev1/ao0"), desk.output("Dev1/ao1", name="out2")
        write(first, staircase(10))
        with pytest.raises(DaqError) as error:
            write(second, staircase(10))
        assert error.value.error_code == -50103
        first.stop()
        write(second, staircase(10))

    def test_single_values_may_go_to_different_outputs(self, desk: Desk) -> None:
        for k in (0, 1):
            task = desk.task(f"out{k}")
            task.ao_channels.add_ao_voltage_chan(f"Dev1/ao{k}")
            task.write(1.0)

    def test_a_line_belongs_to_one_task(self, desk: Desk) -> None:
        tasks = [desk.task(name) for name in ("a", "b", "c")]
        for task, line in zip(tasks, (0, 0, 1), strict=True):
            task.do_channels.add_do_chan(f"Dev1/port0/line{line}")
        tasks[0].write(True)
        tasks[2].write(True)
        with pytest.raises(DaqError) as error:
            tasks[1].write(False)
        assert error.value.error_code == -50103
        assert desk.plant.enabled
        tasks[0].stop()
        tasks[1].write(False)
        assert not desk.plant.enabled


class TestLines:
    def test_the_first_line_is_the_enable_relay(self, desk: Desk) -> None:
        task = desk.task("enable")
        task.do_channels.add_do_chan("Dev1/port0/line0")
        assert not desk.plant.enabled
        task.write(True)
        assert desk.plant.enabled
        assert DigitalSingleChannelReader(task.in_stream).read_one_sample_one_line() is True
        task.close()
        assert desk.plant.enabled

    def test_other_lines_are_not(self, desk: Desk) -> None:
        task = desk.task("enable")
        levels = np.array([True, False, True])
        task.do_channels.add_do_chan("Dev1/port0/line1:3", line_grouping=LineGrouping.CHAN_PER_LINE)
        DigitalMultiChannelWriter(task.out_stream, auto_start=True).write_one_sample_one_line(levels)
        read = np.zeros(3, bool)
        DigitalMultiChannelReader(task.in_stream).read_one_sample_one_line(read)
        assert (read == levels).all()
        assert not desk.plant.enabled


class TestReset:
    def test_outputs_go_to_zero_lines_low_and_tasks_end(self, desk: Desk) -> None:
        output, inputs, line = desk.output(), desk.inputs(), desk.task("enable")
        line.do_channels.add_do_chan("Dev1/port0/line0")
        line.write(True)
        write(output, np.full(2000, 3.0))
        output.start()
        inputs.start()
        assert desk.plant.output == 3.0
        desk.system.devices["Dev1"].reset_device()
        assert desk.plant.output == 0.0
        assert not desk.plant.enabled
        assert inputs.is_task_done()
        assert output.is_task_done()
        # nothing is reserved, and the tasks can be used again
        other = desk.task("zero")
        other.ao_channels.add_ao_voltage_chan("Dev1/ao0")
        other.write(0.0)
        assert len(counts(inputs, 10)) == 10

    def test_an_output_goes_from_what_it_plays_to_zero_at_one_tick(self) -> None:
        # many ticks pass during a reset
        with Desk(speed=100.0, drive="Dev1/ao0") as desk:
            output = desk.output(buffer=400_000)
            played = 0.01 + staircase(400_000) ** 2
            write(output, played)
            output.start()
            desk.plant.pass_ticks(1000)
            desk.system.devices["Dev1"].reset_device()
            desk.plant.pass_ticks(2)
            volts = np.trim_zeros(desk.plant.played(desk.plant.tick()))
        assert 1000 <= volts.size < played.size
        assert (volts == played[: volts.size]).all()

    def test_a_reset_of_the_server_leaves_no_task(self, desk: Desk) -> None:
        desk.output()
        stub = session_pb2_grpc.SessionUtilitiesStub(desk.channel)
        assert stub.ResetServer(session_pb2.ResetServerRequest()).is_server_reset
        desk.output()
