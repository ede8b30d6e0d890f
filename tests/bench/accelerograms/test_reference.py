"""How records are named on a command line, and the names of a campaign."""

from pathlib import Path

import pytest

from bench.accelerograms.reference import RecordReference, read_records
from bench.accelerograms.synthetic import NAMES
from sim.errors import InvalidInput


@pytest.mark.parametrize(
    ("text", "path", "options"),
    [
        ("a.AT2", "a.AT2", {}),
        (r"C:\records\a.AT2", r"C:\records\a.AT2", {}),
        (r"C:\records\a.txt@dt=0.005,unit=cm/sec^2,column=2", None, {"dt": 0.005, "unit": "cm/s2", "column": "2"}),
        ("me@home/a.V2", "me@home/a.V2", {}),
        ("me@home/a.V2@channel=90 deg,name=Kobe", "me@home/a.V2", {"channel": "90 deg", "name": "Kobe"}),
        ("a,b.csv@unit=G", "a,b.csv", {"unit": "g"}),
    ],
)
def test_a_file_with_options(text: str, path: str | None, options: dict[str, object]) -> None:
    found = RecordReference.parse(text)
    assert found.text == text
    assert found.path == Path(path or r"C:\records\a.txt")
    names = ("dt", "unit", "channel", "column", "name")
    assert {name: getattr(found, name) for name in names if getattr(found, name) is not None} == options


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("a@size=3", "size is not one of"),
        ("a@dt=0.01,dt=0.02", "once"),
        ("a@dt=", "have a value"),
        ("a@dt=soon", "positive number of seconds"),
        ("a@dt=-1", "positive number of seconds"),
        ("a@unit=stone", "must be one of"),
        ("@dt=0.01", "it must be FILE"),
        ("synthetic:nowhere", NAMES[0]),
        ("synthetic:", NAMES[0]),
        (f"synthetic:{NAMES[0]}:x", "integer"),
        (f"synthetic:{NAMES[0]}:", "integer"),
        (f"synthetic:{NAMES[0]}@dt=0.1", "no option but name"),
    ],
)
def test_what_is_refused_before_anything_is_read(text: str, word: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        RecordReference.parse(text)
    assert word in str(refusal.value)


def test_synthetic_motions_by_name_and_seed() -> None:
    first, second, named = (
        RecordReference.parse(f"synthetic:{NAMES[0]}{rest}").read() for rest in ("", ":7", ":7@name=other")
    )
    assert first.synthetic
    assert first.sha256 != second.sha256 == named.sha256
    assert named.name == "other"


def column_file(folder: Path, name: str) -> Path:
    file = folder / name
    file.write_text("0.5\n-0.25\n0.125\n")
    return file


def test_options_for_all_files_give_way_to_those_of_one(tmp_path: Path) -> None:
    file = column_file(tmp_path, "a.txt")
    reference = RecordReference.parse(f"{file}@dt=0.02").or_else(unit="g", dt=0.01, channel=None, column=None)
    record = reference.read()
    assert (record.dt, record.unit) == (0.02, "g")
    made = RecordReference.parse(f"synthetic:{NAMES[0]}")
    assert made.or_else(unit="g", dt=0.01, channel="1", column="1") == made


def test_names_within_a_campaign_differ(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    options = "@dt=0.01,unit=g"
    one, two = (f"{column_file(tmp_path, name)}{options}" for name in ("a.txt", "other/A.txt"))
    with pytest.raises(InvalidInput, match="name=ANOTHER"):
        read_records([RecordReference.parse(text) for text in (one, two)])
    records = read_records([RecordReference.parse(text) for text in (one, f"{two},name=b")])
    assert [record.name for record in records] == ["a", "b"]
