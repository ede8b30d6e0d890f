"""Options of the commands: flags of declared parameters, and shared options.

A command is a function whose annotated signature declares its options; `with_flags` adds those of a parameter model.
"""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter as Argument
from inspect import Signature, signature
from math import isclose
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Group, Parameter

from bench.app.formatting import as_typed
from bench.config.declared import Declared, declared, flag
from bench.progress import Progress
from sim.parameters import Parameters

_METAVAR: dict[Any, str] = {int: "INT", float: "NUMBER", str: "TEXT"}


def switch(text: str) -> Parameter:
    """An option without a value and without a negative form."""
    return Parameter(negative=(), show_default=False, help=text)


Handed = Annotated[Progress, Parameter(parse=False)]
"""Argument through which `main` passes the progress display to a command."""

BenchFile = Annotated[
    Path | None,
    Parameter(
        metavar="FILE",
        help="Configuration of the bench (TOML).",
        show_default="the paper's specimen on the simulated bench",
    ),
]
Seed = Annotated[
    str | None, Parameter(metavar="INT", help="Seed of the simulation; replaces that of the configuration.")
]
SpecimenFile = Annotated[
    Path | None,
    Parameter(
        metavar="FILE",
        help="Specimen file (JSON) of identified values, which replace the values assumed in the configuration.",
        show_default="the configuration's specimen_file",
    ),
]
Json = Annotated[
    bool,
    Parameter(
        name="--json",
        negative=(),
        show_default=False,
        help="Print one JSON object on standard output and nothing else there.",
    ),
]
Yes = Annotated[bool, switch("Answer yes to every question to the operator, for an unattended run.")]
CampaignFile = Annotated[
    Path, Parameter(name="FILE", metavar="FILE", help="Data file of a campaign (campaign.h5), opened read-only.")
]
RecordText = Annotated[
    str,
    Parameter(
        name="FILE",
        metavar="FILE",
        help="A record: FILE, FILE@KEY=VALUE,... with the keys unit, dt, channel, column and name, or "
        "synthetic:NAME[:SEED].",
    ),
]


def with_flags(
    model: type[Parameters], title: str, command: Callable[..., int], positional: str | None = None
) -> Callable[..., int]:
    """Add a flag for each field of `model` to a command, in the group `title`; the first argument of the command
    receives a mapping from field names to the typed values.

    Values are passed on as text and validated by the model, not by the command-line parser. The field `positional`, a
    list of texts, becomes a positional argument.
    """
    group = Group(title, sort_key=1)
    fields = list(declared(model))
    own = list(signature(command).parameters.values())[1:]
    placed = [each for each in own if each.kind is not Argument.KEYWORD_ONLY]
    placed += [_by_place(entry, group) for entry in fields if entry.name == positional]
    flags = [_argument(entry, group) for entry in fields if entry.name != positional]

    # cyclopts would use the annotations of equally named arguments instead of those in the signature set below
    def execute(*values: Any, **options: Any) -> int:
        typed = {entry.name: options.pop(entry.name) for entry in fields if entry.name in options}
        if positional is not None:
            return command(typed | ({positional: values} if values else {}), **options)
        return command(typed, *values, **options)

    execute.__doc__, execute.__module__ = command.__doc__, command.__module__
    named = [each for each in own if each.kind is Argument.KEYWORD_ONLY]
    execute.__dict__["__signature__"] = Signature([*placed, *flags, *named])
    return execute


def _several(values: list[object]) -> str:
    """Values as typed on the command line; more than eight equally spaced values as `start:stop:count`."""
    numbers = [value for value in values if isinstance(value, float)]
    if len(numbers) == len(values) > 8:
        first, last, steps = numbers[0], numbers[-1], len(numbers) - 1
        even = (first + (last - first) * k / steps for k in range(len(numbers)))
        if all(isclose(value, place) for value, place in zip(numbers, even, strict=True)):
            return f"{first:g}:{last:g}:{len(numbers)}"
    return " ".join(as_typed(value) for value in values)


def _by_place(entry: Declared, group: Group) -> Argument:
    text = f"{entry.description[:1].upper()}{entry.description[1:]}"
    parameter = Parameter(name="FILE", metavar="FILE", help=text, show_default=False, group=group)
    return Argument(entry.name, Argument.VAR_POSITIONAL, annotation=Annotated[str, parameter])


def _argument(entry: Declared, group: Group) -> Argument:
    unit = "" if entry.unit in ("", "1") else f" {entry.unit}"
    defaults: list[object] = [] if entry.default is None else [*entry.default] if entry.many else [entry.default]
    default = f"{_several(defaults)}{unit}" if defaults else ""
    allowed = ", ".join(entry.choices) or (f"each {entry.limits}" if entry.many and entry.limits else entry.limits)
    text = f"{entry.description[:1].upper()}{entry.description[1:]}"
    details = [f"[{entry.unit}]" if unit else "", f"({allowed})" if allowed else ""]
    parameter = Parameter(
        name=flag(entry.name),
        help=" ".join([text, *(detail for detail in details if detail)]),
        show_default=default or False,
        metavar=None if entry.kind is bool else _METAVAR.get(entry.kind, "WORD") + ("..." if entry.many else ""),
        negative=None if entry.kind is bool else (),
        consume_multiple=entry.many,
        group=group,
    )
    kind = bool if entry.kind is bool else tuple[str, ...] if entry.many else str
    return Argument(entry.name, Argument.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, parameter])


@Parameter(name="*", group=Group("Run", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options of every protocol, in addition to its parameters."""

    config: BenchFile = None
    specimen: SpecimenFile = None
    protocol_file: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="Parameters of the protocol (TOML, with keys like the flags above but _ instead of -); flags "
            "override the file.",
        ),
    ] = None
    out: Annotated[
        Path | None,
        Parameter(
            metavar="DIR",
            help="Folder for the results, created if missing. Existing results are never overwritten.",
            show_default="runs/<protocol>-<local date and time>",
        ),
    ] = None
    seed: Seed = None
    profile: Annotated[
        Literal["fast", "steady"] | None,
        Parameter(
            help=(
                "Timing of the acquisition, instead of block_duration and lead in [acquisition]. With fast, the bench "
                "reacts to a limit within 20 ms (35 ms through a gRPC server, without serial lasers); this requires "
                "an idle computer. With steady, it reacts within 0.2 s."
            ),
        ),
    ] = None
    operator: Annotated[str, Parameter(metavar="NAME", help="Name of the operator, stored in the data file.")] = ""
    note: Annotated[
        tuple[str, ...],
        Parameter(
            metavar="TEXT",
            negative=(),
            show_default=False,
            help="Note to store in the data file; may be given several times.",
        ),
    ] = ()
    queue: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="Check the plan and append the test to this queue instead of running it; `rockbench queue` runs the "
            "queue.",
        ),
    ] = None
    dry_run: Annotated[
        bool,
        switch(
            "Compute the complete run, check it against every limit, and print the margins, without opening a device."
        ),
    ] = False
    yes: Yes = False
    ask: Annotated[
        bool, switch("Ask the operator even on the simulated bench, which otherwise performs the tasks itself.")
    ] = False
    realtime: Annotated[bool, switch("Run the simulated bench in real time instead of as fast as possible.")] = False
    watch: Annotated[
        bool,
        switch("Serve a read-only live page of the run, like `rockbench watch`; the first line states its address."),
    ] = False
    json: Annotated[
        bool,
        switch(
            "Print only one JSON object on standard output: the summary of the run or, with --dry-run, its margins."
        ),
    ] = False

    @property
    def about(self) -> dict[str, str]:
        """Descriptive attributes of the data file, which do not affect the run."""
        texts = {"operator": self.operator, "notes": "\n".join(self.note)}
        return {name: text for name, text in texts.items() if text}


@Parameter(name="*", group=Group("Specimen", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class SpecimenOptions:
    """Options that choose the specimen of a prediction."""

    specimen: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="Specimen: TOML with keys as in the table [specimen] of a configuration, or a specimen file "
            "(.json) of identified values; flags override the file.",
            show_default="the paper's specimen",
        ),
    ] = None
    distance: Annotated[
        str | None,
        Parameter(
            metavar="NUMBER",
            help="Free length d of the coupling spring [m] (above 0).",
            show_default="the specimen's, 0.1 m",
        ),
    ] = None
    restitution_factor: Annotated[
        str | None,
        Parameter(
            metavar="NUMBER",
            help="Ratio of the block's restitution to the theoretical one (at least 0).",
            show_default="the specimen's, 1",
        ),
    ] = None


@Parameter(name="*", group=Group("Result", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class ResultOptions:
    """Destinations of a result in addition to the summary on standard output. Existing files are never overwritten."""

    json: Json = False
    csv: Annotated[Path | None, Parameter(metavar="FILE", help="Write the table as CSV.")] = None
    out: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Write tables, units and the inputs of the computation as HDF5."),
    ] = None
    plot: Annotated[Path | None, Parameter(metavar="FILE", help="Draw the figure: .png (200 dpi), .pdf or .svg.")] = (
        None
    )
