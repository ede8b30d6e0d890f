"""Text of unknown origin is shown, not carried out; a file that another program holds for a moment is renamed later."""

import csv
import errno
import os
from pathlib import Path

import numpy as np
import pytest

from bench import unfinished
from bench.app.cli.output import print_error, print_result
from bench.app.export.format import TableColumn
from bench.app.export.text import write_table
from bench.datafile.tables import Column
from bench.inert import csv_cell, shown
from bench.prediction.files import write_csv

HOSTILE = "a\x1b]0;title\x07\x1b[2J\x9b31m\u202egnp.exe\ud800 [red]b[/red]"
FORMULAS = ("=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "\t=1", "\r=1")


def test_escapes_are_shown_and_markup_is_text(capsys: pytest.CaptureFixture[str]) -> None:
    print_result(dict, lambda: HOSTILE, as_json=False)
    print_error(HOSTILE)
    said = capsys.readouterr()
    for text in (said.out, said.err):
        assert not {"\x1b", "\x07", "\x9b", "\u202e", "\ud800"} & set(text)
        assert "[red]b[/red]" in text
    assert "\\x1b[2J" in said.out
    assert shown("two\nlines\tα ± ✓") == "two\nlines\tα ± ✓"


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_is_a_formula(text: str, tmp_path: Path) -> None:
    assert csv_cell(text) == "'" + text.replace("\r", "\n")
    write_csv(tmp_path / "prediction.csv", {"note": Column(np.array([text]), "", "a note")})
    write_table([TableColumn("note", "", "a note", "text", (text,))], tmp_path / "table.csv")
    for path in tmp_path.iterdir():
        with path.open(encoding="utf-8", newline="") as file:
            assert [row[0][:1] for row in csv.reader(file)] == ["n", "'"]


@pytest.mark.parametrize("number", ["-1.5", "+3", "-inf", "1e-3", "text", ""])
def test_numbers_and_plain_texts_stay(number: str) -> None:
    assert csv_cell(number) == number


@pytest.mark.parametrize("times", [1, 5])
def test_a_file_that_is_held_for_a_moment_is_renamed_later(
    times: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, rename = [times], os.replace

    def held(source: Path, target: Path) -> None:
        if left[0]:
            left[0] -= 1
            raise PermissionError(errno.EACCES, "held by a scanner")
        rename(source, target)

    monkeypatch.setattr(os, "replace", held)
    unfinished.write_new(tmp_path / "result.txt", lambda path: path.write_text("result") and None)
    assert (tmp_path / "result.txt").read_text() == "result"


def test_a_file_that_stays_held_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def held(*_: object) -> None:
        raise PermissionError(errno.EACCES, "held by a scanner")

    monkeypatch.setattr(os, "replace", held)
    monkeypatch.setattr(unfinished, "HELD", 0.2)
    with pytest.raises(unfinished.RockbenchError, match="held by a scanner"):
        unfinished.write_new(tmp_path / "result.txt", lambda path: path.write_text("result") and None)
    assert not list(tmp_path.iterdir())
