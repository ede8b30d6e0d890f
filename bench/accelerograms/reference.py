"""Reference to a record on a command line: `FILE`, `FILE@KEY=VALUE,...` or `synthetic:NAME[:SEED]`.

The options follow the last @, because a path may contain a colon or a comma (`C:\\records\\a.AT2@dt=0.005`).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.choices import LONGEST_STEP, SHORTEST_STEP
from bench.accelerograms.read import read_accelerogram
from bench.accelerograms.units import unit_of
from bench.config.numbers import read_number
from sim.errors import InvalidInput

GRAMMAR = "FILE[@KEY=VALUE,...] with the keys unit, dt, channel, column and name, or synthetic:NAME[:SEED]"

_SYNTHETIC = "synthetic:"
_KEYS = ("unit", "dt", "channel", "column", "name")
_OPTIONS = re.compile(r"\w+=[^=]*(,\w+=[^=]*)*")


@dataclass(frozen=True)
class RecordReference:
    """A requested record: a file, or a synthetic motion with its seed, and options.

    `text` is the reference as typed; `seed` is None for the default seed.
    """

    text: str
    path: Path | None = None
    synthetic: str | None = None
    seed: int | None = None
    unit: str | None = None
    dt: float | None = None
    channel: str | None = None
    column: str | None = None
    name: str | None = None

    @staticmethod
    def parse(text: str) -> "RecordReference":
        """Parse a reference without reading the file. Raises InvalidInput."""
        place, at, tail = text.rpartition("@")
        if not at or _OPTIONS.fullmatch(tail) is None:
            place, tail = text, ""
        options = _options(text, tail)
        unit, dt = options.get("unit"), options.get("dt")
        found = RecordReference(
            text,
            unit=None if unit is None else unit_of(unit, f"unit in {text}"),
            dt=None if dt is None else seconds_of(f"dt in {text}", dt),
            channel=options.get("channel"),
            column=options.get("column"),
            name=options.get("name"),
        )
        if not place.startswith(_SYNTHETIC):
            if not place:
                raise InvalidInput("record", text, f"it must be {GRAMMAR}")
            return replace(found, path=Path(place))
        if set(options) - {"name"}:
            raise InvalidInput("record", text, "a synthetic motion takes no option but name")
        name, colon, seed = place.removeprefix(_SYNTHETIC).partition(":")
        if colon and re.fullmatch(r"[0-9]{1,9}", seed) is None:
            raise InvalidInput(f"seed in {text}", seed, "it must be an integer of at most nine digits")
        _check_synthetic(text, name)
        return replace(found, synthetic=name, seed=int(seed) if colon else None)

    def or_else(
        self, *, unit: str | None, dt: float | None, channel: str | None, column: str | None
    ) -> "RecordReference":
        """The reference with the given defaults for options that it omits; they do not apply to a synthetic motion."""
        if self.path is None:
            return self
        return replace(
            self,
            unit=self.unit if self.unit is not None else unit,
            dt=self.dt if self.dt is not None else dt,
            channel=self.channel if self.channel is not None else channel,
            column=self.column if self.column is not None else column,
        )

    def read(self) -> Accelerogram:
        """Read or synthesise the record. Raises InvalidInput."""
        if self.path is not None:
            record = read_accelerogram(self.path, dt=self.dt, unit=self.unit, channel=self.channel, column=self.column)
        else:
            from bench.accelerograms.synthetic import DEFAULT_SEED, synthetic_record

            record = synthetic_record(self.synthetic or "", DEFAULT_SEED if self.seed is None else self.seed)
        return record if self.name is None else replace(record, name=self.name)


def read_records(references: Sequence[RecordReference]) -> tuple[Accelerogram, ...]:
    """Read all records of a campaign. Raises InvalidInput if one cannot be read or two share a name."""
    records: list[Accelerogram] = []
    owners: dict[str, str] = {}
    for reference in references:
        record = reference.read()
        # the names are used for groups and files, and some file systems ignore case
        key = record.name.lower()
        if key in owners:
            allowed = (
                f"its name, {record.name}, is already used by {owners[key]}; omit one, or add name=ANOTHER after @"
            )
            raise InvalidInput("record", reference.text, allowed)
        owners[key] = reference.text
        records.append(record)
    return tuple(records)


def _options(text: str, tail: str) -> dict[str, str]:
    options: dict[str, str] = {}
    for option in tail.split(",") if tail else ():
        key, equals, value = option.partition("=")
        if not equals and options:
            last = next(reversed(options))
            allowed = f"a decimal comma in {last}? write {last}={options[last]}.{option}; commas separate options"
            raise InvalidInput("record", text, allowed)
        if key not in _KEYS:
            raise InvalidInput("record", text, f"{key} is not one of the keys allowed after @: {', '.join(_KEYS)}")
        if key in options or not value.strip():
            raise InvalidInput("record", text, f"{key} must occur once and have a value")
        options[key] = value.strip()
    return options


def seconds_of(item: str, value: str) -> float:
    """Parse a time step [s]. Raises InvalidInput."""
    try:
        seconds = read_number(value, "s")
    except ValueError as error:
        raise InvalidInput(item, value, str(error) or "it must be a positive number of seconds") from None
    if seconds <= 0.0:
        raise InvalidInput(item, value, "it must be a positive number of seconds")
    if not SHORTEST_STEP <= seconds <= LONGEST_STEP:
        allowed = f"earthquake records have steps of {SHORTEST_STEP:g} to {LONGEST_STEP:g} s: write the unit, as in 5ms"
        raise InvalidInput(item, value, allowed)
    return seconds


def _check_synthetic(text: str, name: str) -> None:
    from bench.accelerograms.synthetic import NAMES

    if name not in NAMES:
        raise InvalidInput("record", text, f"the synthetic motions are {', '.join(NAMES)}")
