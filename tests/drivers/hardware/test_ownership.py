"""Two programs at one bench: the second is refused with the first one's name before it opens a device."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.daqmx.parameters import Daq, EmergencyStop, Heartbeat
from drivers.errors import DeviceNotFound
from drivers.hardware.ownership import FOLDER, devices_of, owned
from drivers.hardware.parameters import Hardware, Laser1, Laser2
from drivers.hardware.rig import HardwareRig

HOLDER = """
import sys
from drivers.hardware.ownership import owned
with owned(sys.argv[1:]):
    print("held", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture(autouse=True)
def locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(FOLDER, str(tmp_path))
    return tmp_path


def _holder(*devices: str) -> "subprocess.Popen[str]":
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, *devices], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_a_device_of_another_program_is_refused_with_its_name_until_it_is_killed() -> None:
    with _holder("Dev1", "COM5") as process:
        with pytest.raises(DeviceNotFound, match=rf"com5 is in use by python -c Dev1 \(process {process.pid}, "):
            owned(["com5"]).__enter__()
        process.kill()
        process.wait()
        with owned(["COM5", "Dev1"]):
            pass


def test_a_rig_is_refused_before_it_opens_the_device() -> None:
    hardware = Hardware(daq=Daq(server="127.0.0.1:1", output="Dev7/ao0", enable_line=None))
    with owned(["Dev7 at 127.0.0.1:1"]), pytest.raises(DeviceNotFound, match=r"Dev7 at 127\.0\.0\.1:1 is in use by"):
        HardwareRig(hardware, lead=100)


def test_the_devices_of_a_bench_are_its_card_and_its_ports() -> None:
    hardware = Hardware(laser_1=Laser1(port="COM5"), laser_2=Laser2(port="COM6"))
    assert devices_of(hardware) == ["Dev1", "COM5", "COM6"]


def test_the_modules_of_a_chassis_belong_to_one_program() -> None:
    drive = Hardware(daq=Daq(output="cDAQ1Mod1/ao0", enable_line="cDAQ1Mod3/port0/line0"))
    assert devices_of(drive) == ["cDAQ1", "cDAQ1Mod1", "cDAQ1Mod3"]
    other = Hardware(daq=Daq(output="CDAQ1MOD2/ao0", enable_line=None))
    with owned(devices_of(drive)), pytest.raises(DeviceNotFound, match="CDAQ1 is in use by"):
        owned(devices_of(other)).__enter__()


def test_the_devices_of_the_digital_lines_are_owned_too() -> None:
    daq = Daq(
        output="Dev1/ao0",
        enable_line="dev1/port0/line0",
        heartbeat=Heartbeat(line="Dev2/port0/line1"),
        emergency_stop=EmergencyStop(line="Dev3/port0/line2"),
    )
    assert sorted(devices_of(Hardware(daq=daq))) == ["Dev1", "Dev2", "Dev3"]


@pytest.mark.parametrize("host", ["localhost", "LocalHost", "127.0.0.1", "[::1]"])
def test_a_server_on_this_machine_has_one_name(host: str) -> None:
    assert devices_of(Hardware(daq=Daq(server=f"{host}:31763"))) == ["Dev1 at 127.0.0.1:31763"]


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="permissions do not apply")
def test_a_folder_that_cannot_be_written_is_named(locks: Path) -> None:
    locks.chmod(0o500)
    with pytest.raises(DeviceNotFound, match=FOLDER):
        owned(["Dev1"]).__enter__()
