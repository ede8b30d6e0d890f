"""A protocol as one object: what it asks for, how it is prepared on a bench, and the result of its run.

`docs/extending.md` has a complete example. A protocol is found by the entry point that names its `Protocol`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar
from typing import Protocol as Interface

from bench.progress import Progress, silent
from sim.parameters import Parameters

if TYPE_CHECKING:
    # a list of protocols and their flags need none of it
    from bench.config.model import BenchConfiguration
    from bench.engine.steps import Outcome, Step
    from bench.events import Event
    from bench.preflight.forecast import Forecast
    from bench.publication.campaign import Campaign
    from bench.record.reader import Record
    from bench.record.tables import Column, Table
    from bench.report.page.document import Section

P = TypeVar("P", bound=Parameters)

Sources: TypeAlias = Mapping[str, Mapping[str, "Column"]]
"""The tables of a data file, by name."""


@dataclass(frozen=True, eq=False)
class Result:
    """The result of a run, also of one that broke off.

    `text` is for the terminal, `findings` for the summary (ready for JSON). `figures` and `files` are written to the
    folder of the run, each by a function of its path; their names are among those that the `Protocol` declares.
    `passed` is the verdict of a protocol that judges the bench, and None of any other.
    """

    points: tuple[Parameters, ...]
    text: str
    figures: Mapping[str, Callable[[Path], None]] = field(default_factory=dict[str, Callable[[Path], None]])
    findings: Mapping[str, object] = field(default_factory=dict[str, object])
    files: Mapping[str, Callable[[Path], None]] = field(default_factory=dict[str, Callable[[Path], None]])
    passed: bool | None = None


Plan: TypeAlias = Generator["Step", "Outcome", Result]
"""The steps of a run, which return its result."""


class Prepared(ABC, Generic[P]):
    """A protocol on a bench, checked and ready to be forecast, planned and run.

    Whatever a run needs of parameters and configuration is computed once, here: a subclass keeps what forecast,
    prediction and plan have in common. `stored` are the tables of the data file that is replayed or analysed again,
    in place of the files that a new run reads; None for a new run.

    The constructor of a subclass raises InvalidInput where the bench cannot do what is asked.
    """

    def __init__(self, parameters: P, configuration: "BenchConfiguration", stored: "Sources | None" = None) -> None:
        self.parameters, self.configuration, self.stored = parameters, configuration, stored
        self.progress: Progress = silent
        """What a long computation reports to."""

    @cached_property
    def forecast(self) -> "Forecast":
        """Stages, demands and duration; empty for a protocol that predicts nothing, which then has no margins.

        Raises InvalidInput for what cannot be planned at all.
        """
        from bench.preflight.forecast import Forecast

        return Forecast()

    @cached_property
    def prediction(self) -> "Table":
        """The expected results, stored before the first sample moves; may be empty."""
        return {}

    @cached_property
    def sources(self) -> Sources:
        """Contents of the files that were read besides the configuration, kept in the data file."""
        return {}

    @abstractmethod
    def plan(self) -> Plan:
        """The steps from the beginning."""

    def collected(self, steps: 'Generator["Step", "Outcome", object]') -> Plan:
        """Carry out `steps`; returns the result of the points that they publish."""
        from bench.engine.steps import Say
        from bench.events import PointFinished

        points: list[Parameters] = []
        try:
            step = next(steps)
            while True:
                if isinstance(step, Say) and isinstance(step.event, PointFinished):
                    points.append(step.event.point)
                step = steps.send((yield step))
        except StopIteration:
            return self.result(points)
        finally:
            steps.close()

    @abstractmethod
    def result(self, points: Sequence[Parameters]) -> Result:
        """The result of a run that broke off, from the points that it has published."""


class Follower(Interface):
    """Watches the recorded plan while it is carried out again, and computes other results from the same samples.

    A subscriber too: it is called with every event, the blocks of a step between `before` and `after`.
    """

    def before(self, step: "Step") -> None:
        """A step is about to be carried out."""
        ...

    def after(self, step: "Step", outcome: "Outcome") -> None:
        """It came to `outcome`."""
        ...

    def __call__(self, event: "Event") -> None: ...

    @property
    def points(self) -> Sequence[Parameters]:
        """The results so far, one for each recorded point."""
        ...


@dataclass(frozen=True)
class Reanalysis(Generic[P]):
    """How recorded results are computed again with other `settings`.

    `follower` is given the settings, the recorded parameters, the configuration to analyse with, and the open file.
    """

    settings: type[Parameters]
    follower: "Callable[[Any, P, BenchConfiguration, Record], Follower]"


@dataclass(frozen=True)
class Protocol(Generic[P]):
    """One experiment. Flags, form, file metadata and documentation follow from `parameters`, tables from `point`.

    `prepare` is given the parameters, the configuration of the bench, and the tables of a data file that is replayed
    or analysed again, else None. It raises InvalidInput where the bench cannot do what is asked, and is the place for
    heavy imports: the object itself is loaded for a list of protocols.

    `example` are arguments that its help shows. `figures` and `files` name everything that a run may write besides the
    data file and the summary, the main figure first. `positional` is the parameter that the command line takes without
    a flag. `log_line` turns a point into one line of a log: a protocol that has it is shown as a log, not as a
    picture. Without a `reanalysis` the plan is carried out again on the recorded samples with other parameters.
    `report` makes the sections of a report that only this protocol has, from its data file.
    """

    name: str
    summary: str
    details: str
    parameters: type[P]
    point: type[Parameters]
    prepare: "Callable[[P, BenchConfiguration, Sources | None], Prepared[P]]"
    example: str = "--dry-run"
    figures: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    positional: str | None = None
    log_line: Callable[[Any], str] | None = None
    reanalysis: Reanalysis[P] | None = None
    report: "Callable[[Campaign], Sequence[Section]] | None" = None
