"""The options that every prediction has on the command line."""

from dataclasses import dataclass, fields
from inspect import Parameter as Argument
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

EXIT_CODES = (
    "The exit code is 0 when the prediction was made, 1 when it failed, 2 when something was refused before it began. "
    "Files that exist are never overwritten."
)

_SPECIMEN = Group("Specimen", sort_key=2)
_RESULT = Group("Result", sort_key=3)


@dataclass(frozen=True, kw_only=True)
class SpecimenOptions:
    """What is predicted for."""

    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            group=_SPECIMEN,
            help="Specimen: TOML with keys as in [specimen] of a configuration, or a specimen file (.json) of what has "
            "been identified; flags win over the file.",
            show_default="the paper's specimen",
        ),
    ] = None
    distance: Annotated[
        str | None,
        Parameter(
            name="--distance",
            metavar="NUMBER",
            group=_SPECIMEN,
            help="Free length d of the coupling spring [m] (above 0).",
            show_default="the specimen's, 0.1 m",
        ),
    ] = None
    restitution_factor: Annotated[
        str | None,
        Parameter(
            name="--restitution-factor",
            metavar="NUMBER",
            group=_SPECIMEN,
            help="Restitution of the block over the theoretical one (at least 0).",
            show_default="the specimen's, 1",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ResultOptions:
    """Where the result goes, beside a summary on standard output. Existing files are never overwritten."""

    json: Annotated[
        bool,
        Parameter(
            name="--json",
            group=_RESULT,
            negative=(),
            show_default=False,
            help="Print one JSON object on standard output and nothing else there.",
        ),
    ] = False
    csv: Annotated[
        Path | None, Parameter(name="--csv", metavar="FILE", group=_RESULT, help="Write the table as CSV.")
    ] = None
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="FILE",
            group=_RESULT,
            help="Write tables, units and what they were computed from as HDF5.",
        ),
    ] = None
    plot: Annotated[
        Path | None,
        Parameter(name="--plot", metavar="FILE", group=_RESULT, help="Draw the figure: .png (200 dpi), .pdf or .svg."),
    ] = None


def arguments_of(options: type[SpecimenOptions] | type[ResultOptions]) -> list[Argument]:
    """One keyword-only argument for each option."""
    return list(signature(options).parameters.values())


def taken(arguments: dict[str, Any], options: type[SpecimenOptions] | type[ResultOptions]) -> dict[str, Any]:
    """Those of the `arguments` that belong to `options`, which are no longer among them."""
    names = {field.name for field in fields(options)} & arguments.keys()
    return {name: arguments.pop(name) for name in names}
