"""Faults on request, the ways in which a server goes away, and what is left when it is closed."""

import socket
import threading
import time
from collections.abc import Iterator

import grpc
import pytest
from nidaqmx._stubs import nidaqmx_pb2, nidaqmx_pb2_grpc
from nidaqmx.errors import DaqError, DaqReadError, RpcError

from drivers.emulation.daqmx.models import x_series
from drivers.emulation.daqmx.server import DaqServer
from sim.errors import InvalidInput
from tests.drivers.emulation.daqmx_loopback import Desk, Wires, counts, staircase, write
from tests.patience import LONG, eventually


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk(speed=2.0) as desk:
        yield desk


def test_a_call_fails_as_often_as_it_was_asked_for(desk: Desk) -> None:
    task = desk.inputs()
    desk.server.fail_next("StartTask", -50405)
    desk.server.fail_next("StartTask", -88716)
    for code in (-50405, -88716):
        with pytest.raises(DaqError) as error:
            task.start()
        assert error.value.error_code == code
    task.start()


def test_a_read_that_fails_says_that_it_has_read_nothing(desk: Desk) -> None:
    task = desk.inputs()
    desk.server.fail_next("ReadBinaryI16", -200361)
    with pytest.raises(DaqReadError) as error:
        counts(task, 10)
    assert (error.value.error_code, error.value.samps_per_chan_read) == (-200361, 0)


def test_a_frozen_server_answers_late_while_its_device_goes_on(desk: Desk) -> None:
    output = desk.output()
    write(output, staircase(200))
    output.start()
    began = time.monotonic()
    desk.server.stall(0.4)
    with pytest.raises(DaqError) as error:
        write(output, staircase(10))
    assert time.monotonic() - began >= 0.4
    assert error.value.error_code == -200290


def test_an_abandoned_read_takes_its_samples_with_it(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    stub = nidaqmx_pb2_grpc.NiDAQmxStub(desk.channel)
    request = nidaqmx_pb2.ReadBinaryI16Request(
        task=task._handle, num_samps_per_chan=1000, timeout=10.0, array_size_in_samps=4000
    )
    with pytest.raises(grpc.RpcError) as error:
        stub.ReadBinaryI16(request, timeout=0.02)
    assert error.value.code() is grpc.StatusCode.DEADLINE_EXCEEDED
    eventually(lambda: task.in_stream.curr_read_pos == 1000)


def test_a_server_that_vanishes_ends_calls_that_wait(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    caught: list[grpc.StatusCode] = []

    def read() -> None:
        try:
            counts(task, 19_000, timeout=2.0 * LONG)
        except RpcError as error:
            caught.append(error.rpc_code)

    thread = threading.Thread(target=read)
    thread.start()
    desk.plant.pass_ticks(100)
    desk.server.vanish()
    # the call would wait for longer
    thread.join(LONG)
    assert not thread.is_alive()
    assert caught
    assert caught[0] in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED)
    with pytest.raises(RpcError) as error:
        task.stop()
    assert error.value.rpc_code is grpc.StatusCode.UNAVAILABLE


def test_the_output_of_a_server_that_has_vanished_holds_its_last_value(desk: Desk) -> None:
    output = desk.output()
    write(output, staircase(100))
    output.start()
    desk.server.vanish()
    desk.plant.pass_ticks(200)
    assert desk.plant.output == staircase(100)[-1]


def test_calls_that_are_not_emulated_say_so(desk: Desk) -> None:
    with pytest.raises(RpcError) as error:
        desk.task("counter").ci_channels.add_ci_count_edges_chan("Dev1/ctr0")
    assert error.value.rpc_code is grpc.StatusCode.UNIMPLEMENTED


def test_nothing_is_left_of_a_closed_server() -> None:
    before = set(threading.enumerate())
    with Desk() as desk:
        desk.inputs().start()
        watchdog = desk.watchdog(5.0)
        reader = threading.Thread(target=_read_until_the_end, args=(desk,))
        reader.start()
        eventually(lambda: desk.plant.tick() > 100)
        host, port = desk.server.address.split(":")
        desk.server.close()
        reader.join(LONG)
        del watchdog
    eventually(lambda: set(threading.enumerate()) <= before)
    with socket.socket() as probe:
        assert probe.connect_ex((host, int(port))) != 0
    desk.server.close()


def _read_until_the_end(desk: Desk) -> None:
    with pytest.raises((DaqError, RpcError)):
        counts(desk.task("in", 2), 19_000, 60.0)


def test_closing_puts_the_output_to_zero_and_opens_the_relay() -> None:
    with Desk(speed=2.0) as desk:
        output, line = desk.output(), desk.task("enable")
        line.do_channels.add_do_chan("Dev1/port0/line0")
        line.write(True)
        write(output, staircase(2000) + 1.0)
        output.start()
    assert desk.plant.output == 0.0
    assert not desk.plant.enabled


def test_an_address_that_is_taken_is_refused(desk: Desk) -> None:
    with pytest.raises(InvalidInput):
        DaqServer(Wires(), [x_series()], address=desk.server.address)
