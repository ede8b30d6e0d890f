"""Conversion of text of unknown origin, such as notes, names and headers of records, to a form that is harmless in
terminals and spreadsheets.
"""

import re

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters other than tab and line feed, marks that change the writing direction, and unpaired surrogates."""
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a text that a spreadsheet evaluates as a formula."""


def shown(text: str) -> str:
    """The text for a terminal, with control characters replaced by escapes, since they could move the cursor or run a
    command.
    """
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def csv_cell(text: str) -> str:
    """The text for a table cell. Prefixes an apostrophe to text, other than a number, that a spreadsheet would evaluate
    as a formula, and replaces carriage returns, which would end the row, by line feeds.
    """
    formula, text = text.startswith(_FORMULA), text.replace("\r\n", "\n").replace("\r", "\n")
    if not formula:
        return text
    try:
        float(text)
    except ValueError:
        return f"'{text}"
    return text
