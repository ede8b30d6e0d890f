"""What a prediction is asked for, from flags and a file of the specimen: refused in one line, or complete and valid."""

from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from bench.cli.flags import flag, given
from bench.cli.refusal import warn
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from sim.knowledge import SpecimenKnowledge
    from sim.specimen import Specimen

P = TypeVar("P", bound=Parameters)

MOST_POINTS = 1_000_000
"""Of all ranges together: more is a slip of the finger."""

SPECIMEN_FILE = ".json"
"""Ending of a specimen file: what has been identified, as opposed to what is assumed."""

_AXES = ("omega", "beta", "corner")

_OF_SPECIMEN: dict[tuple[str | int, ...], str] = {
    ("d",): "--distance",
    ("block", "restitution_factor"): "--restitution-factor",
}


def request_from(model: type[P], arguments: Mapping[str, Any]) -> P:
    """The request that the flags make. Raises InvalidInput."""
    wanted = given(model, arguments)
    axes = [name for name in _AXES if name in wanted]
    points = prod(len(wanted[name]) for name in axes)
    if points > MOST_POINTS:
        raise InvalidInput(" times ".join(flag(name) for name in axes), points, f"at most {MOST_POINTS} points")

    def named(path: tuple[str | int, ...]) -> str:
        return flag(str(path[0])) if path else dotted(path)

    return validated(model, wanted, named)


def warn_of_unusual(request: Parameters, specimen: "Specimen") -> None:
    """One line on standard error for each value that is valid but unusual."""
    from bench.config.review import notices_of, specimen_notices

    for notice in (*notices_of(request, specimen), *specimen_notices(specimen)):
        warn(notice)


def known_from(
    file: Path | None, restitution_factor: str | None, configuration: "BenchConfiguration | None" = None
) -> "SpecimenKnowledge":
    """How well the specimen is known: from a specimen file, else from the configuration. Raises InvalidInput."""
    from bench.config.model import BenchConfiguration
    from bench.config.specimen_file import read_specimen
    from sim.identified import Identified

    known = (configuration or BenchConfiguration()).known
    if file is not None:
        identified = read_specimen(file) if file.suffix == SPECIMEN_FILE else Identified()
        known = known.model_copy(update={"identified": identified})
    if restitution_factor is None:
        return known
    return known.model_copy(update={"identified": known.identified.without("restitution_factor")})


def specimen_from(
    file: Path | None,
    distance: str | None,
    restitution_factor: str | None,
    assumed: "Specimen | None" = None,
    known: "SpecimenKnowledge | None" = None,
) -> "Specimen":
    """The specimen: flags win over the file, the file over the `assumed` one or the paper's; what is identified, as
    `known_from` has it, goes before what is assumed. Raises InvalidInput.
    """
    from bench.config.toml import read_table
    from sim.specimen import Block, Specimen

    table = assumed.model_dump(mode="json") if assumed is not None else {}
    if file is not None and file.suffix != SPECIMEN_FILE:
        table = read_table(file, "--specimen")
    if distance is not None:
        table["d"] = given(Specimen, {"d": distance})["d"]
    if restitution_factor is not None and isinstance(table.setdefault("block", {}), dict):
        table["block"]["restitution_factor"] = given(Block, {"restitution_factor": restitution_factor})[
            "restitution_factor"
        ]
    flags = {
        path for path, value in zip(_OF_SPECIMEN, (distance, restitution_factor), strict=True) if value is not None
    }

    def named(path: tuple[str | int, ...]) -> str:
        if path in flags:
            return _OF_SPECIMEN[path]
        return f"{file.name}: {dotted(path)}" if file is not None else dotted(path)

    specimen = validated(Specimen, table, named)
    identified = known_from(file, restitution_factor).identified if known is None else known.identified
    return identified.applied(specimen)
