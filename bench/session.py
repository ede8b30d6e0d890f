"""One campaign from configuration to files: rig, guard, engine, recorder, report."""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.engine import Engine
from bench.engine.operator import Operator
from bench.engine.requests import Requests
from bench.engine.steps import Plan
from bench.engine.stream import Stream
from bench.events import Event, PointFinished, Subscriber, Warned
from bench.guard.guard import Guard
from bench.preflight.compiled import compile_run, load_bench
from bench.progress import Progress, silent
from bench.provenance import revision, software
from bench.record.recorder import PATIENCE, Recorder
from bench.record.tables import Table
from bench.report.summary import Summary, write_summary
from bench.results import FILE, SUMMARY
from bench.rigs import open_rig, require_drivers
from bench.twin.beside import twin_beside
from drivers.clock import VirtualClock
from drivers.rig import Rig
from sim.parameters import Parameters


class Experiment(Protocol):
    """What a protocol offers to a session. One that is `bench.preflight.forecast.Forecasting` besides has margins."""

    @property
    def name(self) -> str:
        """The protocol's name."""
        ...

    @property
    def figure_name(self) -> str:
        """File name of its figure."""
        ...

    @property
    def parameters(self) -> Parameters:
        """What was asked for."""
        ...

    @property
    def point_type(self) -> type[Parameters]:
        """The type of one result."""
        ...

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput when this bench cannot do what is asked."""
        ...

    def predict(self, configuration: BenchConfiguration) -> Table:
        """What the model expects, stored before the first sample moves."""
        ...

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The steps."""
        ...

    def table(self, points: Sequence[Parameters]) -> str:
        """The results as plain text."""
        ...

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:
        """Draw the results beside the prediction."""
        ...


@runtime_checkable
class Keeping(Protocol):
    """An experiment that leaves a file of its own beside the others, for other runs to load."""

    @property
    def kept_name(self) -> str:
        """Name of the file."""
        ...

    def keep(self, path: Path) -> None:
        """Write it, if the run came to something worth keeping."""
        ...


@runtime_checkable
class Sourced(Protocol):
    """An experiment that reads files besides its configuration; the data file keeps what they hold."""

    def sources(self, configuration: BenchConfiguration) -> Mapping[str, Table]:
        """What was read, as tables. Raises InvalidInput as `Experiment.check` does."""
        ...

    def restore(self, tables: Mapping[str, Table]) -> None:
        """Take it from the tables of a data file, not from the files, from now on."""
        ...


@runtime_checkable
class Illustrated(Protocol):
    """An experiment with more to show than one figure, and more to say than its points."""

    @property
    def further_figures(self) -> tuple[str, ...]:
        """File names of its other figures."""
        ...

    def draw_further(self, folder: Path) -> None:
        """Draw them into `folder`."""
        ...

    def findings(self, points: Sequence[Parameters]) -> Mapping[str, object]:
        """What the points come to, ready for JSON."""
        ...


@runtime_checkable
class Attending(Protocol):
    """A subscriber that is shown the rig before anything moves."""

    def opened(self, rig: Rig) -> None:
        """The rig is open. It belongs to the thread that calls the subscriber, and only while it does."""
        ...


@dataclass(frozen=True)
class SessionResult:
    """How a campaign ended. `summary` is ready for JSON, `table` for the terminal."""

    status: str
    reason: str
    summary: dict[str, object]
    table: str
    interrupted: bool


class _Points:
    """Gathers the points as they are finished."""

    def __init__(self) -> None:
        self.all: list[Parameters] = []

    def __call__(self, event: Event) -> None:
        if isinstance(event, PointFinished):
            self.all.append(event.point)


def run_session(
    protocol: Experiment,
    configuration: BenchConfiguration,
    *,
    out: Path,
    operator: Operator,
    subscribers: Sequence[Subscriber],
    requests: Requests,
    realtime: bool,
    about: Mapping[str, str] | None = None,
    progress: Progress = silent,
) -> SessionResult:
    """Run `protocol` on the configured bench and leave data file, figure and summary in the folder `out`.

    `about` is kept in the data file beside what is known of the run: the operator's name, notes. `progress` is told
    what is done before the rig is opened and after it is closed.
    Raises InvalidInput, or KeyboardInterrupt when an end was asked for, before anything moves. Once the rig is armed
    every ending is a result, with its status.
    """
    started = time.monotonic()
    with requests.without_rig():
        require_drivers(configuration)
        load_bench(configuration, progress)
        progress("checking the protocol against the bench")
        protocol.check(configuration)
        preflight = compile_run(protocol, configuration, out, progress)
        preflight.require()
        # after the hash of the plan: it is the same at every pace
        configuration = configuration.at_pace(realtime=realtime)
        progress("predicting the results")
        prediction = protocol.predict(configuration)
        sources = protocol.sources(configuration) if isinstance(protocol, Sourced) else dict[str, Table]()
        metadata = _metadata(protocol, configuration) | {"plan_hash": preflight.plan_hash, **(about or {})}
    if requests.strongest is not None:
        raise KeyboardInterrupt
    out.mkdir(parents=True, exist_ok=True)
    rig = open_rig(configuration, realtime=realtime)
    try:
        recorder = Recorder(
            out / FILE,
            channels=rig.channels,
            sample_rate=rig.sample_rate,
            point_type=protocol.point_type,
            metadata=metadata | {"devices": json.dumps(rig.description)},
            tables={"prediction": prediction, **preflight.tables, **sources},
            # in virtual time nothing moves on while the disk is waited for
            hold_up=PATIENCE if isinstance(rig.clock, VirtualClock) else 0.0,
        )
        points = _Points()
        stream = Stream(rig.clock, [recorder, points, *subscribers])
        status, reason = "failed", "the program failed"
        try:
            for subscriber in subscribers:
                if isinstance(subscriber, Attending):
                    subscriber.opened(rig)
            signals = SignalMap(rig.channels, configuration.laser_reference, configuration.calibrated)
            engine = Engine(
                rig,
                Guard(rig, configuration.limits, configuration.ramps, configuration.mover, signals),
                stream,
                requests,
                operator,
                configuration.block_samples,
            )
            strange = configuration.calibrated.strange(rig.description) if configuration.calibrated else ()
            for warning in (*strange, *preflight.warnings):
                stream.publish(Warned(warning))
            # as long as the model takes, a bench in virtual time stands still
            patient = isinstance(rig.clock, VirtualClock)
            with twin_beside(stream, rig, configuration, requests, patient=patient):
                ending = engine.run(protocol.plan(configuration))
            status, reason = ending.status, ending.reason
        finally:
            recorder.close(status, reason)
    finally:
        rig.close()
    more = protocol if isinstance(protocol, Illustrated) else None
    summary = Summary(
        protocol=protocol.name,
        status=ending.status,
        points=points.all,
        file=out / FILE,
        figure=out / protocol.figure_name,
        reason=ending.reason,
        software=f"rocking-bench {software()['rocking-bench']}",
        seed=configuration.seed,
        elapsed=time.monotonic() - started,
        bench_time=stream.now(),
        plan_hash=preflight.plan_hash,
        further_figures=[out / name for name in more.further_figures] if more else (),
        findings=more.findings(points.all) if more else {},
    )
    write_summary(out / SUMMARY, summary)
    if isinstance(protocol, Keeping):
        protocol.keep(out / protocol.kept_name)
    if not requests.interrupted:
        # who interrupts does not wait for pictures: `rockbench report` draws them from the file
        with requests.without_rig():
            progress("drawing the figures")
            protocol.figure(points.all, prediction, out / protocol.figure_name)
            if more:
                more.draw_further(out)
    return SessionResult(
        status=ending.status,
        reason=ending.reason,
        summary=summary.as_dict(),
        table=protocol.table(points.all),
        interrupted=requests.strongest is not None,
    )


def _metadata(protocol: Experiment, configuration: BenchConfiguration) -> dict[str, str]:
    return {
        "protocol": protocol.name,
        "parameters": protocol.parameters.model_dump_json(),
        "configuration": configuration.model_dump_json(),
        "specimen": configuration.known_specimen.model_dump_json(),
        **({} if configuration.seed is None else {"seed": str(configuration.seed)}),
        **software(),
        "git": revision(),
    }
