"""The emulated sensor behind a real serial port, opened with the library that the driver uses."""

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import serial

from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.emulation.optoncdt.settings import Settings
from tests.drivers.emulation.optoncdt_client import (
    PERFECT,
    Seen,
    blocks,
    decode,
    metres,
    receive,
    say,
    still,
)
from tests.patience import eventually

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

STREAMING = Settings(output="RS422", rate=4000.0, additional=("COUNTER", "TIMESTAMP"))
Make = Callable[..., EmulatedLaser]
Open = Callable[..., serial.Serial]


@pytest.fixture
def make() -> Iterator[Make]:
    made: list[EmulatedLaser] = []

    def start(sight: Seen | None = None, **options: object) -> EmulatedLaser:
        sensor = EmulatedLaser(sight or still(0.0), PERFECT, **options)  # type: ignore[arg-type]
        made.append(sensor)
        sensor.start()
        return sensor

    yield start
    for sensor in made:
        sensor.close()


@pytest.fixture
def connect() -> Iterator[Open]:
    opened: list[serial.Serial] = []

    def connect_to(sensor: EmulatedLaser, baud: int = 921600) -> serial.Serial:
        port = serial.Serial(sensor.port, baud, timeout=0.01)
        opened.append(port)
        return port

    yield connect_to
    for port in opened:
        port.close()


def enough(count: int) -> Callable[[bytes], bool]:
    return lambda received: len(received) >= count


def test_dialogue_and_stream(make: Make, connect: Open) -> None:
    sensor = make(still(0.05))
    port = connect(sensor)
    assert sensor.analogue
    info = say(port, "GETINFO")
    assert "Name:            ILD1420-200\r\n" in info
    assert "Measuring range: 200.00mm\r\n" in info
    assert say(port, "MEASRATE 4") == "MEASRATE 4 ok\r\n"
    assert say(port, "OUTPUT RS422") == "OUTPUT RS422 ok\r\n"
    assert not sensor.analogue
    assert metres(blocks(receive(port, enough(300)), 1)[-1, 0]) == pytest.approx(0.15, abs=2e-6)
    assert say(port, "OUTPUT NONE") == "OUTPUT NONE ok\r\n"


def test_it_streams_at_power_up_when_it_was_left_so(make: Make, connect: Open) -> None:
    port = connect(make(as_found=STREAMING))
    assert len(blocks(receive(port, enough(1200)), 4)) > 90


def test_answers_stand_between_values(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    port = connect(sensor)
    received = receive(port, enough(1200))
    for _ in range(20):
        port.write(b"GETUSERLEVEL\n")
        received += receive(port, lambda part: b"->" in part)
    received += receive(port, enough(1200))
    values, rest = decode(received)
    assert rest.count(b"GETUSERLEVEL PROFESSIONAL\r\n->") == 20
    assert len(rest) <= 20 * 29 + 4
    counters = [after for (_, first), (after, _) in pairwise(values) if first]
    assert (np.diff(counters) == 1).all()


def test_an_answer_may_be_made_to_split_a_value(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    sensor.split_words()
    port = connect(sensor)
    received, answer, answers, left = receive(port, enough(1200)), b"ECHO ON\r\n->", 0, 0
    # three bytes of each value that was split: on a busy machine not of every answer, without splitting none
    while left <= 15 and answers < 200:
        for _ in range(20):
            port.write(b"ECHO\n")
            received += receive(port, lambda part: answer in part)
        received += receive(port, enough(1200))
        answers += 20
        left = len(decode(received)[1]) - answers * len(answer)
    assert left > 15


def test_the_clock_is_the_sensors_own(make: Make, connect: Open) -> None:
    error = 8e-3
    sensor = make(as_found=STREAMING, clock_error=error)
    port = connect(sensor)
    assert sensor.rate_true == pytest.approx(4000.0 * (1.0 + error))
    # the quickest of many deliveries is late by nearly the same in both parts, whatever else the machine does
    ages: list[tuple[float, float]] = []
    received, began = b"", time.monotonic()
    while (now := time.monotonic()) < began + 1.2:
        received += port.read(max(port.in_waiting, 1))
        found = blocks(received[-200:], 4)
        if len(found):
            ages.append((now - began, now - found[-1, 1] / 4000.0))
    early = min(((age, at) for at, age in ages if at < 0.4), key=lambda pair: pair[0] + error * pair[1])
    late = min(((age, at) for at, age in ages if at > 0.8), key=lambda pair: pair[0] + error * pair[1])
    # counted with the nominal rate, a clock that runs fast seems to deliver ever earlier
    assert (late[0] - early[0]) / (late[1] - early[1]) == pytest.approx(-error, abs=4e-3)
    everything = blocks(received, 4)
    assert (np.diff(everything[:, 1]) == 1).all()
    stamps = everything[:, 2] + 65536 * everything[:, 3]
    assert np.abs(stamps - stamps[0] - 25 * np.arange(len(stamps))).max() <= 1


def test_the_truth_tells_when_a_value_was_seen(make: Make, connect: Open) -> None:
    began = time.monotonic()
    error = 2e-3
    sensor = make(
        Seen(lambda times: 0.08 * np.sin(2.0 * np.pi * (times - began))),
        as_found=replace(STREAMING, output="NONE"),
        clock_error=error,
    )
    port = connect(sensor)
    say(port, "RESETCNT TIMESTAMP MEASCNT")
    say(port, "OUTPUT RS422")
    sent = blocks(receive(port, enough(24000)), 4)
    for block in sent[::97]:
        seen_at = sensor.host_time_of(int(block[1]))
        seen = 0.08 * np.sin(2.0 * np.pi * (seen_at - began))
        assert metres(block[0]) == pytest.approx(0.1 + seen, abs=2e-6)
        stamp = (block[2] + 65536 * block[3]) * 1e-5
        assert sensor.epoch + stamp / (1.0 + error) == pytest.approx(seen_at, abs=1.1e-5)


@pytest.mark.parametrize("baud", [9600, 115200, 1_000_000, 691200])
def test_at_a_wrong_baud_rate_nothing_is_understood(make: Make, connect: Open, baud: int) -> None:
    sensor = make(as_found=STREAMING)
    port = connect(sensor, baud)
    port.write(b"OUTPUT NONE\nGETUSERLEVEL\n")
    received = receive(port, enough(200))
    assert b"->" not in received
    assert len(decode(received)[0]) < len(received) / 6
    assert sensor.settings == STREAMING


@pytest.mark.parametrize("baud", [9600, 56000, 115200, 128000, 256000, 691200, 1_000_000])
def test_the_baud_rate_can_be_changed(make: Make, connect: Open, baud: int) -> None:
    port = connect(make())
    assert say(port, f"BAUDRATE {baud}") == f"BAUDRATE {baud} ok\r\n"
    port.baudrate = baud
    assert say(port, "GETUSERLEVEL") == "GETUSERLEVEL PROFESSIONAL\r\n"


def test_what_was_heard_at_a_wrong_baud_rate_spoils_the_next_command(make: Make, connect: Open) -> None:
    sensor = make()
    port = connect(sensor, 115200)
    port.write(b"GETUSERLEVEL")
    eventually(lambda: sensor._dialogue._received != b"")  # pyright: ignore[reportPrivateUsage]
    port.baudrate = 921600
    assert say(port, "").startswith("E210 ")
    assert say(port, "GETUSERLEVEL") == "GETUSERLEVEL PROFESSIONAL\r\n"


def test_the_port_can_be_opened_again_and_again(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    before = -1
    for _ in range(5):
        port = connect(sensor)
        counter = blocks(receive(port, enough(600)), 4)[0, 1]
        assert counter > before
        before = counter
        port.close()


def test_a_reader_that_is_too_slow_loses_values_and_delays_nothing(
    make: Make, connect: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    sensor = make(as_found=STREAMING)
    with monkeypatch.context() as small:
        small.setattr("drivers.emulation.optoncdt.dialogue._CAPACITY", 2000)
        port = connect(sensor)
        eventually(lambda: sensor.dropped > 2000)
    # from here on nothing is lost, however late this test reads: bytes are lost anywhere, within answers too
    dropped, begun = sensor.dropped, time.monotonic()
    found = blocks(receive(port, enough(30000)), 4)
    # a block of 12 bytes is lost with any of them
    assert 12 * (np.diff(found[:, 1]) - 1).sum() >= dropped
    # after the gap the values are of the present, not of the time in which nobody read
    assert sensor.host_time_of(int(found[-1, 1])) > begun
    assert say(port, "OUTPUT NONE") == "OUTPUT NONE ok\r\n"


def test_a_port_keeps_more_than_a_pseudo_terminal_and_says_how_late_it_was(make: Make, connect: Open) -> None:
    """A pseudo-terminal takes 16 KiB, a third of a second at full rate."""
    sensor = make(as_found=STREAMING)
    port = connect(sensor)
    sensor.take_lateness()
    eventually(lambda: sensor._terminal.pending > 6000)  # pyright: ignore[reportPrivateUsage]
    found = blocks(receive(port, enough(24_000)), 4)
    assert (np.diff(found[:, 1]) == 1).all()
    assert sensor.dropped == 0
    assert sensor.take_lateness() > 0.1


def test_errors_in_place_of_distances(make: Make, connect: Open) -> None:
    sensor = make(as_found=Settings(output="RS422", rate=4000.0))
    port = connect(sensor)

    def comes(code: int) -> None:
        receive(port, lambda received: code in blocks(received[-30:], 1))

    sensor.target("too close")
    comes(262077)
    sensor.target("too far")
    comes(262078)
    sensor.target("none")
    comes(262076)
    sensor.laser_off()
    comes(262082)
    sensor.target(None)
    sensor.laser_on()
    comes(32760)


def test_lost_bytes_cost_their_values_only(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    port = connect(sensor)
    receive(port, enough(1200))
    sensor.lose_bytes(7)
    _, rest = decode(receive(port, enough(6000)))
    # a word cut at either end, and one cut by the reading of this test at either end
    assert 1 <= len(rest) <= 8
    sensor.lose_bytes(probability=0.01)
    values, rest = decode(receive(port, enough(30000)))
    # a word of three bytes stays whole with a probability of 0.97
    assert 0.005 < len(rest) / (3 * len(values)) < 0.04


def test_garbage_comes_once(make: Make, connect: Open) -> None:
    sensor = make()
    port = connect(sensor)
    sensor.garbage(500)
    assert len(receive(port, enough(500))) == 500
    assert say(port, "ECHO") == "ECHO ON\r\n"


@pytest.mark.milliseconds
def test_silence_ends_by_itself_and_the_counter_shows_it(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    port = connect(sensor)
    received = receive(port, enough(1200))
    sensor.silence(0.3)
    received += receive(port, enough(24000))
    gap = np.diff(blocks(received, 4)[:, 1]).max()
    assert gap >= 0.29 * 4000


def test_a_client_notices_that_the_sensor_is_unplugged(make: Make, connect: Open) -> None:
    sensor = make(as_found=STREAMING)
    port = connect(sensor)
    receive(port, enough(1200))
    sensor.unplug()
    sensor.unplug()
    with pytest.raises((serial.SerialException, OSError)):
        receive(port, enough(1_000_000))
    with pytest.raises((serial.SerialException, OSError)):
        port.write(b"GETINFO\n")
    assert not os.path.exists(sensor.port)


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="open files are counted in /proc")
def test_nothing_is_left_after_closing() -> None:
    files, threads = len(os.listdir("/proc/self/fd")), threading.active_count()
    for _ in range(3):
        sensor = EmulatedLaser(still(0.0), PERFECT)
        sensor.start()
        with serial.Serial(sensor.port, 921600, timeout=0.01) as port:
            assert say(port, "ECHO") == "ECHO ON\r\n"
        sensor.close()
        sensor.close()
        EmulatedLaser(still(0.0), PERFECT).close()
    assert len(os.listdir("/proc/self/fd")) == files
    assert threading.active_count() == threads
