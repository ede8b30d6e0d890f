"""A protocol as one object: its parameters, its preparation on a bench, and the result of its run.

`docs/extending.md` has a complete example. A protocol is discovered by the entry point of its `Protocol` object.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar
from typing import Protocol as Interface

from bench.progress import Progress, silent
from sim.parameters import Parameters

if TYPE_CHECKING:
    # imported for type checking only: listing protocols and their flags must be fast
    from bench.config.model import BenchConfiguration
    from bench.datafile.reader import DataFile
    from bench.datafile.tables import Column, Table
    from bench.document.campaign import Campaign
    from bench.document.document import Section
    from bench.engine.steps import Outcome, Step
    from bench.events import Event
    from bench.live_view import Live
    from bench.preflight.margins import Forecast

P = TypeVar("P", bound=Parameters)
T = TypeVar("T")

Sources: TypeAlias = Mapping[str, Mapping[str, "Column"]]
"""Tables of a data file by name, each with its columns by name."""


@dataclass(frozen=True, eq=False)
class Result:
    """Result of a run, complete or interrupted.

    `text` is printed on the terminal; `findings` (JSON content) are stored in the summary. `figures` and `files` are
    written to the folder of the run, each by a function that is called with the path; the `Protocol` declares their
    names. `passed` is the verdict of a protocol that checks the bench, and None for any other.
    """

    points: tuple[Parameters, ...]
    text: str
    figures: Mapping[str, Callable[[Path], None]] = field(default_factory=dict[str, Callable[[Path], None]])
    findings: Mapping[str, object] = field(default_factory=dict[str, object])
    files: Mapping[str, Callable[[Path], None]] = field(default_factory=dict[str, Callable[[Path], None]])
    passed: bool | None = None


Plan: TypeAlias = Generator["Step", "Outcome", Result]
"""Generator that yields the steps of a run and returns its result."""


def each_step(
    plan: 'Generator["Step", "Outcome", T]', carry_out: 'Callable[["Step"], Generator["Step", "Outcome", "Outcome"]]'
) -> 'Generator["Step", "Outcome", T]':
    """`plan` with each step replaced by the steps of `carry_out(step)`, which returns the step's outcome.

    As with `yield from`, an exception thrown into the generator is raised at the current step of `plan`, which may
    handle it.
    """
    try:
        step = next(plan)
        while True:
            try:
                outcome = yield from carry_out(step)
            except GeneratorExit:
                raise
            except BaseException as error:
                step = plan.throw(error)
            else:
                step = plan.send(outcome)
    except StopIteration as end:
        return end.value
    finally:
        plan.close()


class Prepared(ABC, Generic[P]):
    """Protocol prepared for a bench: checked, and ready to be forecast and run.

    The constructor computes, once, the data that forecast, prediction and plan share. `stored` is None for a new run,
    which reads the input files; a replay or re-analysis uses the tables of its data file instead.

    The constructor of a subclass raises InvalidInput for parameters beyond the capabilities of the bench.
    """

    def __init__(self, parameters: P, configuration: "BenchConfiguration", stored: "Sources | None" = None) -> None:
        self.parameters, self.configuration, self.stored = parameters, configuration, stored
        self.progress: Progress = silent
        """Callable to which long computations report their progress."""

    @cached_property
    def forecast(self) -> "Forecast":
        """Stages, demands and duration; empty for a protocol without predictions, for which no margins are shown.

        Raises InvalidInput if no plan is possible.
        """
        from bench.preflight.margins import Forecast

        return Forecast()

    @cached_property
    def prediction(self) -> "Table":
        """Expected results, to be stored before the table moves; may be empty."""
        return {}

    @cached_property
    def sources(self) -> Sources:
        """Contents of the input files other than the configuration, to be stored in the data file."""
        return {}

    @abstractmethod
    def plan(self) -> Plan:
        """Generator that yields the steps of the run and returns its result."""

    def collected(self, steps: 'Generator["Step", "Outcome", object]') -> Plan:
        """Yield `steps` and return the result computed from the points that they publish."""
        from bench.engine.steps import Publish
        from bench.events import PointFinished

        points: list[Parameters] = []

        def collect(step: "Step") -> 'Generator["Step", "Outcome", "Outcome"]':
            if isinstance(step, Publish) and isinstance(step.event, PointFinished):
                points.append(step.event.point)
            return (yield step)

        yield from each_step(steps, collect)
        return self.result(points)

    @abstractmethod
    def result(self, points: Sequence[Parameters]) -> Result:
        """Result of a run, complete or interrupted, from the points that it published."""


class Follower(Interface):
    """Subscriber to a replay of the recorded plan that computes results with other settings from the same samples.

    Called with every event; the blocks of a step arrive between `before` and `after`.
    """

    def before(self, step: "Step") -> None:
        """Called before a step."""
        ...

    def after(self, step: "Step", outcome: "Outcome") -> None:
        """Called after a step, with its `outcome`."""
        ...

    def __call__(self, event: "Event") -> None: ...

    @property
    def points(self) -> Sequence[Parameters]:
        """Results so far, one for each recorded point."""
        ...


@dataclass(frozen=True)
class Reanalysis(Generic[P]):
    """Re-analysis of recorded results with other `settings`.

    `follower` is called with the settings, the recorded parameters, the configuration for the analysis and the open
    file.
    """

    settings: type[Parameters]
    follower: "Callable[[Any, P, BenchConfiguration, DataFile], Follower]"


@dataclass(frozen=True)
class Axis:
    """An axis of the points of a campaign: the `parameter` with its values, the `field` of a point with the same
    quantity, and the `heading` of a value, such as "β {:g}".
    """

    parameter: str
    field: str
    heading: str = "{}"

    def text(self, value: object) -> str:
        """Heading of a value."""
        return self.heading.format(value)


@dataclass(frozen=True)
class RunView:
    """Display of a run. `headline` is the field of a point whose value, prediction and verdict are shown largest, by
    default the first field with an uncertainty. `labels` are the printed names of fields of a point, such as
    "restitution rₑₓₚ"; a field without a label is shown with the first words of its description. `matrix` has the axes
    of the rows and the columns in which the points are arranged, if the values on them are known before the run;
    `by_columns` tells that the points of a column are measured one after the other, not those of a row. `live` returns
    the live view of the window for a `bench.live_view.LiveRun`; the default is `bench.live_view.standard_view`.
    """

    headline: str = ""
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    matrix: tuple[Axis, Axis] | None = None
    by_columns: bool = False
    live: "Live | None" = None


@dataclass(frozen=True)
class Protocol(Generic[P]):
    """An experiment. Flags, form, file metadata and documentation are generated from `parameters`, and tables from
    `point`.

    `prepare` takes the parameters, the bench configuration and, for a replay or re-analysis, the tables of the data
    file, otherwise None. It raises InvalidInput for parameters beyond the capabilities of the bench. Listing the
    protocols imports this object: wrap a `prepare` with heavy imports in `deferred`.

    `events` lists, as "module:Event", the events that the protocol declares and that have a table in the data file.
    `example` holds arguments shown in the help. `figures` and `files` name all files that a run may write in addition
    to data file and summary, with the main figure first. `positional` is the parameter that the command line accepts
    without a flag. `log_line` formats a point as one log line: the run is then displayed as a log, not as a plot.
    Without a `reanalysis`, an analysis runs the plan with other parameters on the recorded samples. `report` returns
    the protocol's own sections of a report on its data file; if they include no table, the report lists all fields of
    the points. `view` declares how the window and the report name and display the results.
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
    events: tuple[str, ...] = ()
    positional: str | None = None
    log_line: Callable[[Any], str] | None = None
    reanalysis: Reanalysis[P] | None = None
    report: "Callable[[Campaign], Sequence[Section]] | None" = None
    view: RunView = field(default_factory=RunView)

    @property
    def event_types(self) -> "tuple[type[Event], ...]":
        """The types of `events`, imported at this call."""
        return tuple(resolve_name(each) for each in self.events)


def deferred(reference: str) -> Callable[..., Any]:
    """Callable that imports and calls the function or class `module:name`, written as in an entry point."""
    module, name = reference.split(":")

    def call(*args: Any, **kwargs: Any) -> Any:
        return getattr(import_module(module), name)(*args, **kwargs)

    return call
