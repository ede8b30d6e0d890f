"""Files of K-NET and KiK-net (`.NS`, `.EW1`, ...): 17 header lines, then the recorder's integer counts.

A sample is its count times the scale factor, minus the mean of all samples: the recorders have an offset, and the peak
in the header is relative to the mean. Source: NIED, "About K-NET ASCII format" and K-NET/KiK-net FAQ 2.
"""

import re

from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import NUMBER, Samples, numbers, value_of
from bench.accelerograms.stated import check_peak, count_in, number_in
from bench.accelerograms.text import RecordText

_HEADER, _KEY = 17, 18
"""Number of header lines, and width of a key in characters."""

_SCALE = re.compile(rf"({NUMBER})\s*\(gal\)\s*/\s*({NUMBER})", re.IGNORECASE)
_CHANNELS = {"1": "NS1", "2": "EW1", "3": "UD1", "4": "NS2", "5": "EW2", "6": "UD2"}
"""KiK-net sensors: 1 to 3 in the borehole, 4 to 6 at the surface."""


def recognise(text: RecordText) -> bool:
    """Whether the file begins with the origin time and has a scale factor."""
    return text.lines[0].startswith("Origin Time") and "Scale Factor" in _keys(text)


def read(text: RecordText, choices: Choices) -> Reading:
    """Read a K-NET or KiK-net file. Raises InvalidInput."""
    refuse_choice(text, choices, "channel", "column")
    where = _keys(text)
    values = {key: text.lines[index][_KEY:].strip() for key, index in where.items()}
    for key in ("Sampling Freq(Hz)", "Duration Time(s)", "Dir."):
        if key not in values:
            raise text.refusal(min(_HEADER, len(text.lines)) - 1, f"the header above it does not state {key!r}")
    scale = _SCALE.search(values["Scale Factor"])
    if scale is None or value_of(scale[2]) == 0.0:
        raise text.refusal(where["Scale Factor"], "it must be like 3920(gal)/6182761; the header is damaged")
    at = where["Sampling Freq(Hz)"]
    rate = count_in(text, at, re.sub("Hz$", "", values["Sampling Freq(Hz)"]), "the sampling frequency")
    seconds = number_in(text, where["Duration Time(s)"], values["Duration Time(s)"], "the duration")
    counts = numbers(text, _HEADER, len(text.lines), round(seconds * rate))
    factor = value_of(scale[1]) / value_of(scale[2])
    offset = float(counts.values.mean())
    samples = Samples(factor * (counts.values - offset), counts.texts)
    peak = next((key for key in values if re.fullmatch(r"Max\.? Acc\. \(gal\)", key)), None)
    if peak is not None:
        number_in(text, where[peak], values[peak], "the peak")
        check_peak(text, where[peak], values[peak], samples, resolution=factor)
    note = f"the mean of all samples, {factor * offset:.6g} gal, was subtracted as the recorder's offset"
    direction = values["Dir."]
    values["Dir."] = f"{direction} ({_CHANNELS[direction]})" if direction in _CHANNELS else direction
    return Reading(
        format="KiK-net ASCII" if direction in _CHANNELS else "K-NET ASCII",
        values=samples.values,
        dt=1.0 / rate,
        unit="gal",
        header={**{key: value for key, value in values.items() if value}, "note": note},
    )


def _keys(text: RecordText) -> dict[str, int]:
    return {line[:_KEY].strip(): index for index, line in enumerate(text.lines[:_HEADER])}
