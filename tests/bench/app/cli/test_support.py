"""The machine is checked with remedies; a fault report is collected, without names on request."""

import json
import zipfile
from pathlib import Path

import pytest

from bench.app.cli.main import main
from bench.app.support import doctor
from bench.app.support.bundle import anonymised
from bench.app.support.doctor import Health
from tests.bench.datafile.example import METADATA, begin, block, record

Said = pytest.CaptureFixture[str]
PARTS = {"overview.json", "versions.json", "journal.jsonl", "last-data.csv", "configuration.json"}


def test_the_machine_is_checked_item_by_item(tmp_path: Path, capsys: Said) -> None:
    code = main(["doctor", "--out", str(tmp_path), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == (0 if found["good"] else 1)
    assert {"versions", "clock", "disk space", "disk speed", "serial ports"} <= {
        each["item"] for each in found["checks"]
    }
    assert all(each["remedy"] for each in found["checks"] if each["health"] == "bad")
    assert main(["doctor", "--out", str(tmp_path / "none")]) == 2


def test_a_slow_serial_adapter_and_a_power_saver_are_found(tmp_path: Path) -> None:
    adapter, port = tmp_path / "usb" / "ttyUSB0", tmp_path / "dev" / "ttyUSB0"
    for folder in (adapter, port.parent):
        folder.mkdir(parents=True)
    port.touch()
    (adapter / "latency_timer").write_text("16\n")
    found = doctor.serial_ports(tmp_path / "usb", tmp_path / "dev", "linux")
    assert (found.health, "latency_timer" in found.remedy) == (Health.BAD, True)
    (adapter / "latency_timer").write_text("1\n")
    assert doctor.serial_ports(tmp_path / "usb", tmp_path / "dev", "linux").health is Health.GOOD
    governor = tmp_path / "governor"
    governor.write_text("powersave\n")
    assert doctor.power(governor, "linux").health is Health.NOTICE
    assert doctor.device_server("127.0.0.1:1").health is Health.BAD


@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_what_is_checked_on_linux_only_is_not_called_good_elsewhere(system: str) -> None:
    found = [doctor.power(system=system), doctor.serial_ports(system=system), doctor.opengl(system=system)]
    if system == "darwin":
        found.append(doctor.usb_suspend(system=system))
    assert {(each.health, each.found) for each in found} == {(Health.UNKNOWN, "not checked on this platform")}
    assert all(each.remedy for each in found)


def test_a_report_has_log_configuration_versions_and_data(tmp_path: Path, capsys: Said) -> None:
    path, target = tmp_path / "campaign.h5", tmp_path / "report.zip"
    record(begin(path, metadata={**METADATA, "operator": "Jane Roe", "notes": "see /home/jane/x.txt"}), block(0, 200))
    assert main(["file", "bundle", str(path), "--out", str(target)]) == 0
    with zipfile.ZipFile(target) as archive:
        assert set(archive.namelist()) >= PARTS
        assert len(archive.read("last-data.csv").splitlines()) == 201
        assert b"Jane Roe" in archive.read("overview.json")
    assert main(["file", "bundle", str(path), "--out", str(target)]) == 2
    anonymous = tmp_path / "anonymous.zip"
    assert main(["file", "bundle", str(path), "--out", str(anonymous), "--anonymous", "--json"]) == 0
    capsys.readouterr()
    with zipfile.ZipFile(anonymous) as archive:
        for name in archive.namelist():
            for secret in (b"Jane", b"jane", str(tmp_path).encode()):
                assert secret not in archive.read(name), name


def test_a_damaged_file_is_reported_too(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(500))
    assert main(["file", "bundle", str(path)]) == 0
    with zipfile.ZipFile(tmp_path / "campaign-bundle.zip") as archive:
        assert b"not available" in archive.read("overview.json")
        assert b"rocking-bench" in archive.read("versions.json")


def test_paths_of_both_systems_are_removed() -> None:
    text = anonymised(r"cannot open C:\Users\jane\x.h5 nor /home/jane/x.h5; 3 m/s2", ())
    assert text == "cannot open (removed) nor (removed); 3 m/s2"


def test_units_and_lines_of_devices_are_no_paths() -> None:
    text = "the gain is 0.52 m/s2/V (0.5 m/s2/V), the noise 1e-3 m/s2/Hz^0.5; Dev1/port0/line1 is open"
    assert anonymised(text, ()) == text
    assert json.loads(anonymised(json.dumps({"text": text}), ())) == {"text": text}
    assert anonymised("runs/jane/s2/V.h5, /s2/V, /port0/line1", ()) == "runs(removed), (removed), (removed)"


def test_notes_names_and_paths_of_the_journal_are_removed() -> None:
    note = {
        "kind": "OperatorNote",
        "text": "Mr. X leant on it (Jim Poe)",
        "columns": {"text": "Mr. X", "by": "Jim Poe"},
    }
    answer = {"kind": "OperatorAnswered", "text": "confirmed", "columns": {"by": "Ann Lee", "after": 1.5}}
    lines = "".join(json.dumps(each) + "\n" for each in (note, answer))
    for secret in ("Mr. X", "Jim Poe", "Ann Lee"):
        assert secret not in anonymised(lines, ())
    kept = [json.loads(line) for line in anonymised(lines, ()).splitlines()]
    assert kept[1] == {"kind": "OperatorAnswered", "text": "confirmed", "columns": {"by": "(removed)", "after": 1.5}}
    for folder in ("C:\\Users\\Jane Doe\\bench", "/home/jane/My Lab"):
        configuration = json.dumps({"table_model": f"{folder}/model.json", "seed": 3})
        assert json.loads(anonymised(configuration, ())) == {"table_model": "(removed)", "seed": 3}
