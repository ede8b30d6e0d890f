"""Opening a sensor: what it is told, what is checked, and what is said when it is not as it should be."""

from pathlib import Path

import pytest
from serial import SerialException

from drivers.errors import ConnectionLost, DeviceNotFound, DeviceTimeout, RigError
from drivers.optoncdt import port
from drivers.optoncdt.dialogue import CommandRefused, Dialogue
from drivers.optoncdt.port import has_baud, open_port
from drivers.optoncdt.search import BAUDS
from drivers.optoncdt.sensor import SerialLaser
from sim.errors import InvalidInput
from tests.drivers.optoncdt.peer import Peer, no_thread_left
from tests.drivers.optoncdt.script import INFO, OPENED, SILENCED, Script, measurements, replaced


def opened(path: str, *, baud: int | None = 921_600, rate: float = 4000.0, measuring_range: float = 0.2) -> SerialLaser:
    return SerialLaser("laser_1", path, baud=baud, rate=rate, measuring_range=measuring_range)


def test_a_sensor_is_told_everything_and_says_who_it_is() -> None:
    with no_thread_left(), Peer(OPENED) as peer, opened(peer.path, baud=None) as laser:
        assert laser.info.serial == "15030002"
        assert laser.description == (
            f"ILD1420-200, 200 mm, serial number 15030002, firmware 001.010, {peer.path} at 921600 baud"
        )
        assert laser.silent


def test_one_that_is_streaming_is_stopped_first() -> None:
    """Its first answers are lost in values, and more values are on their way."""
    stream = b"".join(measurements(range(300), 0))
    script = [(b"OUTPUT NONE", stream), (b"OUTPUT NONE", stream[1:] + b"->" + stream[:50]), *OPENED[1:]]
    with Peer(script) as peer, opened(peer.path):
        pass


def test_answers_may_be_echoed_padded_and_with_line_feeds_only() -> None:
    def echoed(command: bytes, answer: bytes) -> bytes:
        return (command + b" ok\r\n" + answer).replace(b"\r", b"")

    script = [(command, echoed(command, answer)) for command, answer in OPENED]
    with Peer(script) as peer, opened(peer.path) as laser:
        assert laser.info.firmware == "001.010"


def test_a_warning_is_no_error() -> None:
    script = [*replaced(OPENED, OUTADD_RS422=b"W320 The measuring output was adapted\r\n->"), *OPENED[-2:]]
    with Peer(script) as peer, opened(peer.path):
        pass


def test_a_fast_sensor_on_the_factorys_baud_rate_sends_its_counter_only() -> None:
    script = [
        (
            command.replace(b"MEASRATE 4", b"MEASRATE 8").replace(b" TIMESTAMP", b""),
            answer.replace(b"MEASRATE 4", b"MEASRATE 8"),
        )
        for command, answer in OPENED
    ]
    with Peer(script) as peer, opened(peer.path, rate=8000.0):
        pass


@pytest.mark.parametrize(
    ("script", "error", "text"),
    [
        (
            replaced(SILENCED, GETINFO=INFO.replace(b"ILD1420-200", b"ILD1320-200")),
            DeviceNotFound,
            "is of model ILD1320-200, .*connect an ILD1420",
        ),
        (
            replaced(SILENCED, GETINFO=INFO.replace(b"200.00mm", b" 50.00mm")),
            InvalidInput,
            r"hardware\.laser_1\.measuring_range = 0\.2 is refused: laser_1 on .* has a range of 0\.05 m: correct",
        ),
        (
            replaced(OPENED, MASTERMV=b"MASTERMV MASTER 12.500000\r\n->"),
            RigError,
            r"zero shifted \(MASTERMV MASTER 12\.500000\); set MASTERMV NONE",
        ),
        (
            [
                *replaced(OPENED, MASTERMV=b"E210 Unknown command\r\n->"),
                (b"MASTERMV NONE", b"E210 Unknown command\r\n->"),
            ],
            RigError,
            "neither reports whether its zero is shifted nor resets it: E210 Unknown command; set",
        ),
        (
            replaced(OPENED[:5], MEASRATE=b"E236 Value out of range\r\n->"),
            InvalidInput,
            r"hardware\.lasers\.rate = 4000\.0 is refused: .* does not accept this rate \(E236 Value out of range\)",
        ),
        (
            [*OPENED[:5], (b"MEASRATE", b"MEASRATE 2\r\n->")],
            InvalidInput,
            r"hardware\.lasers\.rate = 4000\.0 is refused: .* measures at 2000 1/s instead",
        ),
        ([*OPENED[:5], (b"MEASRATE", b"MEASRATE fast\r\n->")], RigError, r"reports an unreadable rate \('FAST'\)"),
        (
            replaced(OPENED, TRIGGER=b"TRIGGER E202 Access denied\r\n->"),
            CommandRefused,
            "refused TRIGGER NONE: E202 Access denied; select the professional user level",
        ),
        (
            replaced(OPENED, OUTHOLD=b"E234 Wrong parameter\r\n->"),
            CommandRefused,
            "refused OUTHOLD NONE: E234 Wrong parameter; check the command",
        ),
        (
            replaced(OPENED, GETOUTINFO_RS422=b"GETOUTINFO_RS422 DIST1\r\n->"),
            RigError,
            "sends DIST1 instead of distance, counter, timestamp; its firmware is not supported",
        ),
        (replaced(OPENED, AVERAGE=b""), DeviceTimeout, "did not reply to AVERAGE NONE within 1 s; check its power"),
    ],
)
def test_a_sensor_that_is_not_as_it_should_be_is_refused(script: Script, error: type[Exception], text: str) -> None:
    with Peer(script) as peer:
        with pytest.raises(error, match=text):
            opened(peer.path)
        # nobody holds the port any more
        open_port("next", peer.path, 921_600).close()


def test_another_sensor_of_the_same_range_is_refused_by_its_serial_number() -> None:
    wanted = {"baud": 921_600, "rate": 4000.0, "measuring_range": 0.2}
    with Peer(SILENCED) as peer:
        with pytest.raises(InvalidInput, match=r"is the sensor 15030002: swap the ports") as caught:
            SerialLaser("laser_1", peer.path, **wanted, serial_number="15030001")
        assert caught.value.item == "hardware.laser_1.serial_number"
    with Peer(OPENED) as peer, SerialLaser("laser_1", peer.path, **wanted, serial_number="15030002"):
        pass


@pytest.mark.parametrize("noise", [b"", b"\xff->\x80:->"])
def test_a_line_without_a_sensor_is_refused_after_all_baud_rates(noise: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.optoncdt.search._PROBE", 0.05)
    asked: list[int] = []
    monkeypatch.setattr("drivers.optoncdt.search.has_baud", lambda _, baud: asked.append(baud) or True)
    with (
        Peer([], baud=38_400, noise=noise) as peer,
        pytest.raises(DeviceNotFound, match=r"does not respond at any baud rate: .* pairs"),
    ):
        opened(peer.path, baud=115_200)
    assert asked[0] == 115_200
    assert sorted(asked) == sorted(BAUDS)


@pytest.mark.parametrize("noise", [b"", b"\xfe\xff\x80"])
def test_the_baud_rate_is_searched_for(noise: bytes) -> None:
    with Peer(OPENED, baud=1_000_000, noise=noise) as peer, opened(peer.path, baud=None) as laser:
        assert laser.baud == 1_000_000


def test_a_baud_rate_that_is_not_the_sensors_is_refused() -> None:
    with (
        Peer(SILENCED, baud=1_000_000) as peer,
        pytest.raises(InvalidInput, match=r"hardware\.laser_1\.baud = 921600 .* responds at 1000000 baud: set"),
    ):
        opened(peer.path)


def test_a_baud_rate_that_no_sensor_has_is_refused_before_anything_is_opened() -> None:
    with pytest.raises(
        InvalidInput, match=r"hardware\.laser_1\.baud = 57600 is refused: the sensor supports 9600, 19200"
    ):
        opened("/dev/nothing", baud=57_600)


@pytest.mark.parametrize("baud", BAUDS)
def test_every_baud_rate_of_the_sensor_can_be_set(baud: int) -> None:
    with Peer([]) as peer, open_port("laser_1", peer.path, 9600) as line:
        assert has_baud(line, baud)


def test_a_port_in_use_is_refused() -> None:
    with (
        Peer([]) as peer,
        open_port("laser_2", peer.path, 921_600),
        pytest.raises(DeviceNotFound, match=rf"laser_1 cannot be opened: {peer.path} is in use; close"),
    ):
        opened(peer.path)


def test_an_absent_port_is_refused_with_those_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(port, "listed_ports", lambda: ["/dev/ttyUSB7"])
    with pytest.raises(DeviceNotFound, match=r"there is no port /dev/nothing; .*/dev/ttyUSB7"):
        opened("/dev/nothing")


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (
            SerialException(13, "could not open port /dev/ttyUSB0"),
            "this account may not use COM5; add it to the group",
        ),
        (SerialException(16, "could not open port /dev/ttyUSB0"), "COM5 is in use; close"),
        (
            SerialException("could not open port 'COM5': PermissionError(13, 'Access is denied.')"),
            "COM5 is in use; close",
        ),
        (
            SerialException("could not open port 'COM5': FileNotFoundError(2, 'No file.')"),
            "there is no port COM5; plug",
        ),
        (SerialException("Cannot configure port, something went wrong"), "COM5 does not work .*something went wrong"),
        (ValueError("Custom baud rate refused"), "COM5 does not work .*rate refused"),
    ],
)
def test_what_the_system_says_of_a_port_is_told(error: Exception, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The texts are those of the serial library on Linux and on Windows."""

    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(port, "Serial", fail)
    with pytest.raises(DeviceNotFound, match=f"laser_1 cannot be opened: {text}"):
        opened("COM5")


def test_a_file_is_no_port(tmp_path: Path) -> None:
    (tmp_path / "port").touch()
    with pytest.raises(DeviceNotFound, match="does not work as a serial port"):
        opened(str(tmp_path / "port"))


def test_a_port_that_goes_during_a_dialogue_is_a_lost_connection() -> None:
    with Peer([]) as peer, open_port("laser_1", peer.path, 921_600) as line:
        dialogue = Dialogue("laser_1", line)
        peer.unplug()
        for talk in (lambda: dialogue.ask("GETINFO"), lambda: dialogue.send("GETINFO"), lambda: dialogue.drain(0.1, 1)):
            with pytest.raises(ConnectionLost, match=r"laser_1 was disconnected .* reopen it"):
                talk()
