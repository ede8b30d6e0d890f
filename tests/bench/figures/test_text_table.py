"""Tables of text: aligned, whole on every output, and harmless whatever a file's names hold."""

import os
import subprocess
import sys
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.figures.text_table import TextColumn, text_table

COLUMNS = (TextColumn("beta", "1"), TextColumn("status", words=True), TextColumn("omega", "rad/s"))


def test_words_are_flush_left_and_numbers_flush_right_below_title_unit_and_rule() -> None:
    assert text_table(COLUMNS, [["0.4", "steady", "16.123"], ["10.45", "x", "-"]]).splitlines() == [
        " beta  status    omega",
        "  [1]          [rad/s]",
        "----------------------",
        "  0.4  steady   16.123",
        "10.45  x             -",
    ]


def test_a_table_without_units_has_no_line_of_them_and_one_without_rows_a_head() -> None:
    columns = (TextColumn("a"), TextColumn("b", words=True))
    assert text_table(columns, [["1", "x"]]).splitlines() == ["a  b", "----", "1  x"]
    assert text_table(columns, []).splitlines() == ["a  b", "----"]


def test_markup_is_text_and_what_no_terminal_should_act_on_is_replaced() -> None:
    names = ["[red]a[/red] :smile:", "\x1b[31mred", "two\nlines", "bell\a and\ttab"]
    lines = text_table((TextColumn("name", words=True),), ([name] for name in names)).splitlines()
    assert lines[2:] == ["[red]a[/red] :smile:", "�[31mred", "two�lines", "bell� and�tab"]


def test_a_row_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="3 columns has rows of"):
        text_table(COLUMNS, [["1", "2"]])


CELLS = st.text(st.characters(min_codepoint=33, max_codepoint=0x17F, exclude_categories=("C", "Z", "M")), max_size=60)


@given(st.lists(st.lists(CELLS.filter(bool), min_size=3, max_size=3), max_size=20))
def test_every_cell_is_there_whole_in_its_column(rows: Sequence[Sequence[str]]) -> None:
    _, _, rule, *lines = text_table(COLUMNS, rows).splitlines()
    assert set(rule) == {"-"}
    assert [line.split() for line in lines] == [list(row) for row in rows]
    assert all(len(line) <= len(rule) for line in lines)
    # the last column is set flush right: every line ends with the rule
    assert all(len(line) == len(rule) for line in lines)


@pytest.mark.parametrize("variables", [{}, {"COLUMNS": "20"}, {"FORCE_COLOR": "1", "TERM": "xterm-256color"}])
def test_a_pipe_gets_the_same_plain_lines_whatever_the_terminal_is(variables: dict[str, str]) -> None:
    code = """
from bench.figures.text_table import TextColumn, text_table
print(text_table((TextColumn("a" * 70, "1"), TextColumn("b" * 70)), [["1" * 70, "2" * 70]]))
"""
    environment = {**os.environ, **variables}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        f"{'a' * 70}  {'b' * 70}",
        f"{'[1]':>70}",
        "-" * 142,
        f"{'1' * 70}  {'2' * 70}",
    ]
