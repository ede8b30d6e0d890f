"""ESM's and ITACA's `.ASC` files: `KEY: value` lines (64 in DYNA 1.2), then one sample per line.

AFAD's files have the same header. Source: ESM database, "ASCII DYNA 1.2 format"; Luzi et al. (2016).
"""

from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import numbers
from bench.accelerograms.stated import acceleration_unit, check_peak, count_in, not_acceleration, number_in
from bench.accelerograms.text import RecordText

_LONGEST_HEADER = 100
_COUNT, _STEP, _UNIT, _TYPE = "NDATA", "SAMPLING_INTERVAL_S", "UNITS", "DATA_TYPE"


def recognise(text: RecordText) -> bool:
    """Whether the file begins with EVENT_NAME and states NDATA."""
    return text.lines[0].startswith("EVENT_NAME:") and _COUNT in _keys(text)


def read(text: RecordText, choices: Choices) -> Reading:
    """Read an ESM file. Raises InvalidInput."""
    refuse_choice(text, choices, "channel", "column")
    where = _keys(text)
    values = {key: text.lines[index].partition(":")[2].strip() for key, index in where.items()}
    last = max(where.values())
    for key in (_STEP, _UNIT, _TYPE):
        if not values.get(key):
            raise text.refusal(last, f"the header above does not state {key}; download the file again")
    if values[_TYPE].upper() != "ACCELERATION":
        raise not_acceleration(text, where[_TYPE], values[_TYPE])
    samples = numbers(text, last + 1, len(text.lines), count_in(text, where[_COUNT], values[_COUNT]))
    unit = acceleration_unit(text, where[_UNIT], values[_UNIT])
    peak = "PGA_" + values[_UNIT].upper()
    if values.get(peak):
        number_in(text, where[peak], values[peak], "the peak")
        check_peak(text, where[peak], values[peak], samples)
    return Reading(
        format="ESM ASCII",
        values=samples.values,
        dt=number_in(text, where[_STEP], values[_STEP], "the step"),
        unit=unit,
        header={key: value for key, value in values.items() if value},
    )


def _keys(text: RecordText) -> dict[str, int]:
    """Line indices of the header values, by key."""
    found: dict[str, int] = {}
    for index, line in enumerate(text.lines[:_LONGEST_HEADER]):
        key, colon, _ = line.partition(":")
        if not colon:
            break
        found[key.strip()] = index
    return found
