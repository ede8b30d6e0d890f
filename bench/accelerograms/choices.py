"""Merges the user's choices for a file with its contents; conflicts raise an error."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isclose, isfinite

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.text import RecordText
from bench.accelerograms.units import UNITS, unit_of
from sim.errors import InvalidInput

SHORTEST_STEP, LONGEST_STEP = 1e-4, 0.5
"""Plausible range of a record's time step [s], with a margin: strong motion is sampled at 50 to 1000 Hz, old film
records at 10 Hz or more.
"""

_SAME_STEP = 1e-6
"""Relative difference up to which two time steps, written with different numbers of digits, count as equal."""


@dataclass(frozen=True)
class Choices:
    """Time step [s], unit, channel and column specified by the user for a file; None where not specified."""

    dt: float | None = None
    unit: str | None = None
    channel: str | None = None
    column: str | None = None


@dataclass(frozen=True, eq=False)
class Reading:
    """Contents read from a file: `values`, shape (n,), in `unit`, with the step `dt` [s]. `dt` and `unit` are None if
    the file does not state them.

    `part` names the channel or column when the file has several.
    """

    format: str
    values: NDArray[np.float64]
    dt: float | None
    unit: str | None
    header: Mapping[str, str] = field(default_factory=dict[str, str])
    part: str = ""


def refuse_choice(text: RecordText, choices: Choices, *names: str) -> None:
    """Raise InvalidInput if a choice of `names` ("channel", "column"), which the format does not allow, is set."""
    remedies = {
        "channel": "this format has no channels",
        "column": "a column can be selected only in a file of plain columns",
    }
    for name in names:
        value = getattr(choices, name)
        if value is not None:
            raise InvalidInput(f"{name} of {text.path.name}", value, f"{remedies[name]}; omit it")


def also_required(*, step: bool, unit: bool) -> str:
    """What else must be given for a file that does not state its `step` or its `unit`, so that one attempt is enough;
    empty if neither is missing.
    """
    missing = [option for option, absent in (("dt=SECONDS", step), ("unit=UNIT", unit)) if absent]
    return f"; the file also requires {' and '.join(missing)}, after a comma each" if missing else ""


def combine(text: RecordText, choices: Choices, reading: Reading) -> Accelerogram:
    """The accelerogram in m/s2. Raises InvalidInput if a choice contradicts the file, if neither states the step or the
    unit, or if the samples are fewer than two, not all finite or all zero.
    """
    name = text.path.name
    unstated = choices.unit is None and reading.unit is None
    dt = _step(name, choices.dt, reading.dt, also_required(step=False, unit=unstated))
    unit = _unit(name, choices.unit, reading.unit)
    values = UNITS[unit] * reading.values
    if values.size < 2 or not np.isfinite(values).all():
        raise InvalidInput("record", name, "it must have at least two samples, all of them finite")
    if not values.any():
        raise InvalidInput("record", name, "every sample is zero: it contains no motion")
    return Accelerogram(
        name=text.path.stem + (f"-{reading.part}" if reading.part else ""),
        acceleration=values,
        dt=dt,
        source=str(text.path),
        format=reading.format,
        unit=unit,
        sha256=text.sha256,
        header=dict(reading.header),
    )


def _step(name: str, given: float | None, stated: float | None, also: str) -> float:
    if given is not None and not (isfinite(given) and given > 0.0):
        raise InvalidInput(f"dt of {name}", given, "it must be a positive number of seconds")
    if stated is not None and not (isfinite(stated) and stated > 0.0):
        raise InvalidInput(
            f"dt of {name}", stated, "the step stated in the file is not a positive time: the file is damaged"
        )
    if stated is not None and not SHORTEST_STEP <= stated <= LONGEST_STEP:
        raise InvalidInput(
            f"dt of {name}",
            stated,
            f"the file states this step [s], but earthquake records have {SHORTEST_STEP:g} to {LONGEST_STEP:g} s: is "
            "its time in ms, or an index? give the time in s",
        )
    if given is None and stated is None:
        allowed = f"the file does not state its time step; give it as @dt=SECONDS{also}"
        raise InvalidInput(f"dt of {name}", None, allowed)
    if given is not None and stated is not None and not isclose(given, stated, rel_tol=_SAME_STEP):
        raise InvalidInput(f"dt of {name}", given, f"the file states {stated:g} s; omit dt")
    # prefer the file's digits, if any
    return stated if stated is not None else float(given or 0.0)


def _unit(name: str, given: str | None, stated: str | None) -> str:
    chosen = None if given is None else unit_of(given, f"unit of {name}")
    if chosen is None and stated is None:
        allowed = f"the file does not state its unit; give it as @unit=UNIT, one of {', '.join(UNITS)}"
        raise InvalidInput(f"unit of {name}", None, allowed)
    if chosen is not None and stated is not None and UNITS[chosen] != UNITS[stated]:
        raise InvalidInput(f"unit of {name}", chosen, f"the file states {stated}; omit the unit")
    return stated or chosen or ""
