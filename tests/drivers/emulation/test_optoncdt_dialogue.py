"""What the emulated sensor answers, at instants that the test makes up."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.emulation.optoncdt.evaluation import Fault
from drivers.emulation.optoncdt.settings import BAUDS, Settings
from tests.drivers.emulation.optoncdt_client import PERFECT, Bare, still

MANUAL = """\
Name:            ILD1420-10
Serial:          15030002
Option:          000
Article:         4120212
Cable head:      Wire
Measuring range: 10.00mm
Version:         001.010
Hardware-rev:    00
Boot-version:    001.000
"""
"""The example of the manual, p. 97."""


def test_information_is_laid_out_as_in_the_manual() -> None:
    bare = Bare(laser=PERFECT.model_copy(update={"measuring_range": 0.01}), echo=True)
    assert bare.say("GETINFO") == "GETINFO\r\n" + MANUAL.replace("\n", "\r\n") + "->"
    bare.say("ECHO OFF")
    assert bare.say("GETINFO") == MANUAL.replace("\n", "\r\n") + "->"


def test_with_echo_the_command_comes_back() -> None:
    bare = Bare(echo=True)
    assert bare.say("MEASRATE 8") == "MEASRATE 8 ok\r\n->"
    assert bare.say("ECHO OFF") == "->"
    assert bare.say("MEASRATE 4") == "->"
    assert bare.say("ECHO ON") == "ECHO ON ok\r\n->"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_command_may_come_in_pieces_and_with_others(end: str) -> None:
    bare = Bare()
    command = f"MEASRATE{end}OUTPUT{end}OUTHOLD"
    pieces = [bare.dialogue.receive(character.encode(), bare.now) for character in command]
    assert b"".join(pieces) == b"MEASRATE 4\r\n->OUTPUT RS422\r\n->"
    assert bare.dialogue.receive(end.encode(), bare.now) == b"OUTHOLD NONE\r\n->"


@pytest.mark.parametrize(
    "setting",
    [
        *(f"MEASRATE {rate}" for rate in ("0.25", "0.5", "1", "2", "4", "8")),
        *(f"OUTPUT {output}" for output in ("NONE", "RS422", "ANALOG")),
        *(f"BAUDRATE {baud}" for baud in BAUDS),
        "OUTADD_RS422 NONE",
        "OUTADD_RS422 COUNTER TIMESTAMP",
        "OUTADD_RS422 SHUTTER INTENSITY STATE DIST_RAW",
        "OUTHOLD NONE",
        "OUTHOLD INFINITE",
        "OUTHOLD 1",
        "OUTHOLD 1024",
        "OUTREDUCECOUNT 1",
        "OUTREDUCECOUNT 3000000",
        "OUTREDUCEDEVICE NONE",
        "OUTREDUCEDEVICE RS422 ANALOG",
        "AVERAGE NONE",
        "AVERAGE MOVING 128",
        "TRIGGER EDGE",
        "LASERPOW OFF",
        "LANGUAGE DE",
        "MASTERMV NONE",
        "MASTERMV MASTER 1.500000",
    ],
)
def test_a_setting_is_answered_as_the_command_that_makes_it(setting: str) -> None:
    bare = Bare()
    assert bare.say(setting) == "->"
    assert bare.say(setting.split()[0]) == f"{setting}\r\n->"
    assert f"{setting}\r\n" in bare.say("PRINT")
    assert bare.say("PRINT ALL") == bare.say("PRINT")


@pytest.mark.parametrize(
    ("command", "number"),
    [
        ("MEASURE 4", 210),
        ("\xff\xfe", 210),
        ("GETINFO ALL", 232),
        ("OUTPUT RS422 ANALOG", 232),
        ("MASTERMV MASTER", 232),
        ("OUTPUT ETHERNET", 234),
        ("OUTADD_RS422 SPEED", 234),
        ("AVERAGE MEDIAN 9", 234),
        ("RESETCNT ALL", 234),
        ('LANGUAGE "EN', 234),
        ("MEASRATE 3", 236),
        ("MEASRATE fast", 236),
        ("MEASRATE nan", 236),
        ("BAUDRATE 57600", 236),
        ("OUTHOLD 0", 236),
        ("OUTHOLD 1025", 236),
        ("OUTREDUCECOUNT 0", 236),
        ("OUTREDUCECOUNT 3000001", 236),
        ("AVERAGE MOVING 3", 236),
        ("MASTERMV MASTER -1", 602),
        ("MASTERMV MASTER 400.1", 602),
        ("LOGIN 123", 202),
        ("X" * 256, 214),
    ],
)
def test_what_is_wrong_is_refused_and_changes_nothing(command: str, number: int) -> None:
    bare = Bare()
    before = bare.sensor.settings
    answer = bare.dialogue.receive(command.encode("latin-1") + b"\n", bare.now).decode()
    assert answer.startswith(f"E{number} ")
    assert answer.endswith("\r\n->")
    assert bare.sensor.settings == before


def test_a_command_without_end_is_forgotten_but_for_its_length() -> None:
    bare = Bare()
    for _ in range(100):
        assert bare.dialogue.receive(b"X" * 1000, bare.now) == b""
    assert bare.say("").startswith("E214 ")
    assert bare.say("OUTPUT") == "OUTPUT RS422\r\n->"


def test_a_user_looks_and_a_professional_changes() -> None:
    bare = Bare()
    assert bare.say("GETUSERLEVEL") == "GETUSERLEVEL PROFESSIONAL\r\n->"
    assert bare.say("LOGOUT") == "->"
    assert bare.say("GETUSERLEVEL") == "GETUSERLEVEL USER\r\n->"
    for command in ("MEASRATE 2", "MASTERMV NONE", "BASICSETTINGS STORE", "SETDEFAULT ALL"):
        assert bare.say(command).startswith("E202 Access denied")
    assert bare.say("MEASRATE") == "MEASRATE 4\r\n->"
    assert bare.say("LOGIN 000") == "->"
    assert bare.say("MEASRATE 2") == "->"


def test_a_changed_rate_is_that_of_the_stream() -> None:
    bare = Bare(additional=("COUNTER",))
    first = bare.stream(0.5, 2)
    bare.say("MEASRATE 0.5")
    second = bare.stream(2.0, 2)
    assert len(second) == pytest.approx(1000, abs=10)
    assert (np.diff(second[:, 1]) == 1).all()
    assert second[0, 1] > first[-1, 1]


def test_outputs_exclude_each_other() -> None:
    bare = Bare(output="ANALOG")
    assert len(bare.stream(0.1)) == 0
    bare.say("OUTPUT RS422")
    assert len(bare.stream(0.1)) > 300
    bare.say("OUTPUT NONE")
    assert len(bare.stream(0.1)) == 0


def test_a_sensor_that_waits_for_a_trigger_sends_nothing() -> None:
    bare = Bare()
    bare.say("TRIGGER SOFTWARE")
    assert len(bare.stream(0.1)) == 0
    bare.say("TRIGGER NONE")
    assert len(bare.stream(0.1)) > 300


@pytest.mark.parametrize(("value", "code"), [("0", 32760), ("200", 96995), ("400", 161231)])
def test_mastering_shifts_the_scale_to_18_bits(value: str, code: int) -> None:
    # x = (100 d / MR + 51) 65520 / 102 (manual, p. 65) at d = the master value, MR = 200 mm
    bare = Bare(still(0.03))
    bare.say(f"MASTERMV MASTER {value}")
    assert set(bare.stream(0.1)[5:, 0]) == {code}
    bare.say("MASTERMV NONE")
    assert bare.stream(0.1)[-1, 0] == round((100 * 0.65 + 1) * 65520 / 102)


def test_mastering_waits_two_seconds_for_a_distance() -> None:
    bare = Bare()
    bare.sensor.target = Fault.NO_PEAK
    assert bare.say("MASTERMV MASTER 1") == ""
    bare.now += 1.9
    assert bare.say("MEASRATE") == ""
    bare.now += 0.2
    assert bare.dialogue.receive(b"", bare.now) == b"E104 Timeout\r\n->MEASRATE 4\r\n->"
    assert bare.say("MASTERMV") == "MASTERMV NONE\r\n->"
    assert bare.say("MASTERMV MASTER 1") == ""
    bare.sensor.target = None
    assert bare.dialogue.receive(b"", bare.now) == b"->"
    assert bare.say("MASTERMV") == "MASTERMV MASTER 1.000000\r\n->"


def test_a_reset_starts_with_what_is_stored() -> None:
    bare = Bare(additional=("COUNTER",))
    bare.stream(0.5, 2)
    bare.say("MEASRATE 1")
    assert bare.say("BASICSETTINGS STORE") == "->"
    bare.say("BAUDRATE 115200")
    assert bare.say("RESET") == "->"
    assert bare.say("MEASRATE") == ""
    assert len(bare.stream(0.4, 2)) == 0
    bare.now += 0.2
    assert bare.say("MEASRATE") == "MEASRATE 4\r\n->"
    assert bare.say("BAUDRATE") == "BAUDRATE 921600\r\n->"
    assert bare.stream(0.1, 2)[0, 1] < 0.2 * 4000


def test_settings_of_device_and_measurement_are_stored_apart() -> None:
    bare = Bare()
    found = bare.sensor.stored
    bare.say("MEASRATE 1")
    bare.say("BAUDRATE 115200")
    assert bare.say("MEASSETTINGS STORE test") == "->"
    assert bare.sensor.stored == replace(found, rate=1000.0)
    assert bare.say("BASICSETTINGS READ") == "->"
    assert bare.say("BAUDRATE") == "BAUDRATE 921600\r\n->"
    bare.say("MEASRATE 4")
    assert bare.say("MEASSETTINGS READ test") == "->"
    assert bare.say("MEASRATE") == "MEASRATE 1\r\n->"
    assert bare.say("SETDEFAULT ALL") == "->"
    assert bare.sensor.settings == bare.sensor.stored == found


def test_as_it_comes_it_does_not_stream_on_its_line() -> None:
    assert Settings().output == "ANALOG"
    assert Settings().baud == 921600
