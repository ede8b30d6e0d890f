"""The options that every protocol has on the command line."""

from dataclasses import dataclass
from inspect import Parameter as Argument
from inspect import signature
from pathlib import Path
from typing import Annotated

from cyclopts import Group, Parameter

_RUN = Group("Run", sort_key=2)


@dataclass(frozen=True, kw_only=True)
class Options:
    """How a protocol is run, as opposed to what it asks for."""

    config: Annotated[
        Path | None,
        Parameter(
            name="--config",
            metavar="FILE",
            group=_RUN,
            help="Configuration of the bench (TOML).",
            show_default="the paper's specimen on the simulated bench",
        ),
    ] = None
    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            group=_RUN,
            help="Specimen file (JSON) of what has been identified: it goes before what the configuration assumes.",
            show_default="the configuration's specimen_file",
        ),
    ] = None
    protocol_file: Annotated[
        Path | None,
        Parameter(
            name="--protocol-file",
            metavar="FILE",
            group=_RUN,
            help="Parameters of the protocol (TOML, keys as the flags above with _ for -); flags win over the file.",
        ),
    ] = None
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="DIR",
            group=_RUN,
            help="Folder for the results; made if missing. Results that are there already are never overwritten.",
            show_default="runs/<protocol>-<local date and time>",
        ),
    ] = None
    seed: Annotated[
        str | None,
        Parameter(
            name="--seed", metavar="INT", group=_RUN, help="Seed of the simulation, in place of the configuration's."
        ),
    ] = None
    operator: Annotated[
        str, Parameter(name="--operator", metavar="NAME", group=_RUN, help="Who runs it; kept in the data file.")
    ] = ""
    note: Annotated[
        tuple[str, ...],
        Parameter(
            name="--note",
            metavar="TEXT",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Something to remember; kept in the data file. May be given several times.",
        ),
    ] = ()
    queue: Annotated[
        Path | None,
        Parameter(
            name="--queue",
            metavar="FILE",
            group=_RUN,
            help="Do not run it: check the plan and add it at the end of this queue, which `rockbench queue` runs.",
        ),
    ] = None
    dry_run: Annotated[
        bool,
        Parameter(
            name="--dry-run",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Compute the whole run, check it against every limit, print the margins and stop: nothing is opened.",
        ),
    ] = False
    yes: Annotated[
        bool,
        Parameter(
            name="--yes",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Answer yes to the operator's questions: an unattended run.",
        ),
    ] = False
    ask: Annotated[
        bool,
        Parameter(
            name="--ask",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Ask the operator even on the simulated bench, which else does the hand work by itself.",
        ),
    ] = False
    realtime: Annotated[
        bool,
        Parameter(
            name="--realtime",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Let the simulated bench run at the pace of the wall clock, not as fast as it can.",
        ),
    ] = False
    json: Annotated[
        bool,
        Parameter(
            name="--json",
            group=_RUN,
            negative=(),
            show_default=False,
            help="Print one JSON object, the summary of the run or its margins, on standard output, and nothing else.",
        ),
    ] = False

    @property
    def about(self) -> dict[str, str]:
        """What is kept in the data file about the run and changes nothing in it."""
        told = {"operator": self.operator, "notes": "\n".join(self.note)}
        return {name: text for name, text in told.items() if text}


def arguments_of_options() -> list[Argument]:
    """One keyword-only argument for each option."""
    return list(signature(Options).parameters.values())
