"""Older ITACA `.acc` files: ten header lines, then five columns of 14 characters that may touch.

The samples are checked against the peak stated in the header. Source: ITACA 1.x (Luzi et al. 2008).
"""

from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import numbers
from bench.accelerograms.stated import acceleration_unit, check_peak, count_in, not_acceleration, number_in
from bench.accelerograms.text import RecordText

_HEADER, _WIDTH = 10, 14
_COUNT, _STEP = "Number of Data", "Time Increment (s)"


def recognise(text: RecordText) -> bool:
    """Whether the file begins with the event's date and states the number of samples."""
    return text.lines[0].startswith("Event Date & Time") and _COUNT in _keys(text)


def read(text: RecordText, choices: Choices) -> Reading:
    """Read an ITACA file. Raises InvalidInput."""
    refuse_choice(text, choices, "channel", "column")
    where = _keys(text)
    values = {key: text.lines[index].partition(":")[2].strip() for key, index in where.items()}
    if _STEP not in values or len(text.lines) <= _HEADER:
        raise text.refusal(len(text.lines) - 1, f"the header above it must state {_STEP!r}, and samples must follow")
    quantity, _, unit_text = text.lines[_HEADER - 1].partition(" time series in ")
    # the database spells it "Accelaration"
    if not quantity.strip().lower().startswith("accel"):
        raise not_acceleration(text, _HEADER - 1, quantity.strip() or "nameless")
    unit = acceleration_unit(text, _HEADER - 1, unit_text)
    count = count_in(text, where[_COUNT], values[_COUNT])
    samples = numbers(text, _HEADER, len(text.lines), count, _WIDTH)
    peak = next((key for key in values if key.startswith("PGA")), None)
    if peak is not None:
        number_in(text, where[peak], values[peak], "the peak")
        check_peak(text, where[peak], values[peak], samples)
    return Reading(
        format="ITACA acc",
        values=samples.values,
        dt=number_in(text, where[_STEP], values[_STEP], "the step"),
        unit=unit,
        header=values,
    )


def _keys(text: RecordText) -> dict[str, int]:
    return {
        line.partition(":")[0].strip(): index for index, line in enumerate(text.lines[: _HEADER - 1]) if ":" in line
    }
