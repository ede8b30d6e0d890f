"""What the comments above plain columns say of step and unit.

Prose may mean another column or an earlier stage, so that it only guards: a choice that disagrees with it is refused.
"""

import re
from math import isclose

from bench.accelerograms.choices import Choices
from bench.accelerograms.numbers import NUMBER, value_of
from bench.accelerograms.text import RecordText
from bench.accelerograms.units import UNITS, spelled

_STEP = re.compile(rf"\bdt\s*[=:]\s*({NUMBER})", re.IGNORECASE)
_UNIT = re.compile(r"\b[cm]?m/s(?:ec)?(?:(?:\^|\*\*)?2\b|/s(?:ec)?\b)", re.IGNORECASE)


def check_comments(text: RecordText, count: int, choices: Choices) -> None:
    """Refuse a step or a unit that one of the first `count` lines contradicts. Raises InvalidInput naming the line."""
    for index, line in enumerate(text.lines[:count]):
        step, unit = _STEP.search(line), _UNIT.search(line)
        if step is not None and choices.dt is not None and not isclose(value_of(step[1]), choices.dt, rel_tol=1e-6):
            raise text.refusal(index, f"it says {step[0]}, and dt={choices.dt:g} was given; correct one of them")
        stated = None if unit is None else spelled(unit[0])
        given = None if choices.unit is None else spelled(choices.unit)
        if stated is not None and given is not None and UNITS[stated] != UNITS[given]:
            raise text.refusal(index, f"it says {stated}, and unit={given} was given; correct one of them")
