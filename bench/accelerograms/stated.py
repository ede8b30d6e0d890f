"""Values stated in a file's header: parsing, and comparison with the samples."""

import re

import numpy as np

from bench.accelerograms.numbers import NUMBER, Samples, place, value_of
from bench.accelerograms.text import RecordText
from bench.accelerograms.units import spelled
from sim.errors import InvalidInput


def check_peak(text: RecordText, index: int, stated: str, samples: Samples, resolution: float | None = None) -> None:
    """Check the largest magnitude of the samples against the value stated in line `index`, in the samples' unit.

    The tolerance is one unit in the last digit of each value; `resolution`, in the samples' unit, replaces the unit in
    the samples' last digit if they were written in another unit. Raises InvalidInput.
    """
    at = int(np.abs(samples.values).argmax())
    found = abs(float(samples.values[at]))
    last_digit = place(samples.texts[at]) if resolution is None else resolution
    if abs(abs(value_of(stated)) - found) > (place(stated) + last_digit) * (1.0 + 1e-9):
        raise text.refusal(
            index,
            f"the stated peak is {stated}, but the largest sample is {found:g}: the file is damaged or was changed",
        )


def number_in(text: RecordText, index: int, stated: str, item: str) -> float:
    """A number stated in header line `index`. Raises InvalidInput naming `item` and the line."""
    word = stated.strip()
    if re.fullmatch(NUMBER, word) is None:
        raise text.refusal(index, f"{item} must be a number; the header is damaged")
    return value_of(word)


def count_in(text: RecordText, index: int, stated: str, item: str = "the number of samples") -> int:
    """An integer above 1 stated in header line `index`. Raises InvalidInput naming `item` and the line."""
    word = stated.strip()
    if re.fullmatch(r"\d+", word) is None or int(word) < 2:
        raise text.refusal(index, f"{item} must be an integer of at least 2; the header is damaged")
    return int(word)


def acceleration_unit(text: RecordText, index: int, stated: str) -> str:
    """The unit stated in line `index`. Raises InvalidInput if it is not a known unit of acceleration."""
    unit = spelled(stated)
    if unit is None:
        raise text.refusal(index, f"{stated.strip()!r} is not a known unit of acceleration")
    return unit


def not_acceleration(text: RecordText, index: int, quantity: str) -> InvalidInput:
    """The error for a file that contains another quantity, as stated in line `index`."""
    return text.refusal(
        index, f"this is a {quantity.lower()} file; use the acceleration file of the same record (PEER: .AT2)"
    )
