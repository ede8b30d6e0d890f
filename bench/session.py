"""One campaign from configuration to files: rig, guard, engine, recorder, report."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.engine import Engine
from bench.engine.operator import Operator
from bench.engine.requests import Requests
from bench.engine.stream import Stream
from bench.events import Event, PointFinished, Subscriber, Warned
from bench.guard.guard import Guard
from bench.preflight.compiled import compile_run
from bench.progress import Progress, silent
from bench.protocol import Prepared, Protocol, Result
from bench.provenance import revision, software
from bench.record.recorder import PATIENCE, Recorder
from bench.report.summary import Summary, write_summary
from bench.results import FILE, SUMMARY
from bench.rigs import open_rig, require_drivers
from bench.twin.beside import twin_beside
from drivers.clock import VirtualClock
from drivers.rig import Rig
from sim.errors import UNKNOWN, Cause
from sim.parameters import Parameters


@dataclass(frozen=True)
class SessionResult:
    """How a campaign ended. `summary` is ready for JSON, `table` for the terminal.

    `passed` is the verdict of a protocol that judges the bench, True of any other.
    """

    status: str
    reason: str
    summary: dict[str, object]
    table: str
    interrupted: bool
    passed: bool = True
    cause: Cause = UNKNOWN


class _Points:
    """Gathers the points as they are finished."""

    def __init__(self) -> None:
        self.all: list[Parameters] = []

    def __call__(self, event: Event) -> None:
        if isinstance(event, PointFinished):
            self.all.append(event.point)


def run_session(
    protocol: Protocol[Any],
    prepared: Prepared[Any],
    *,
    out: Path,
    operator: Operator,
    subscribers: Sequence[Subscriber],
    requests: Requests,
    realtime: bool,
    about: Mapping[str, str] | None = None,
    opened: Callable[[Rig], None] = lambda _rig: None,
    progress: Progress = silent,
) -> SessionResult:
    """Run a protocol that is `prepared` on its bench; leave data file, figures and summary in the folder `out`.

    `opened` is shown the rig before anything moves; it may be used only while the engine calls a subscriber. `about` is
    kept in the data file beside what is known of the run: the operator's name, notes. `progress` is told
    what is done before the rig is opened and after it is closed.
    Raises InvalidInput, or KeyboardInterrupt when an end was asked for, before anything moves. Once the rig is armed
    every ending is a result, with its status.
    """
    started = time.monotonic()
    with requests.without_rig():
        if requests.strongest is not None:
            raise KeyboardInterrupt
        require_drivers(prepared.configuration)
        preflight = compile_run(protocol.name, prepared, out, progress)
        preflight.require()
        # after the hash of the plan: it is the same at every pace
        configuration = prepared.configuration.at_pace(realtime=realtime)
        progress("predicting the results")
        prediction = {"prediction": prepared.prediction} if prepared.prediction else {}
        tables = {**prediction, **preflight.tables, **prepared.sources}
        metadata = _metadata(protocol, prepared.parameters, configuration)
        metadata |= {"plan_hash": preflight.plan_hash, **(about or {})}
    if requests.strongest is not None:
        raise KeyboardInterrupt
    out.mkdir(parents=True, exist_ok=True)
    rig = open_rig(configuration, realtime=realtime)
    try:
        recorder = Recorder(
            out / FILE,
            channels=rig.channels,
            sample_rate=rig.sample_rate,
            point_type=protocol.point,
            metadata=metadata | {"devices": json.dumps(rig.description)},
            tables=tables,
            # in virtual time nothing moves on while the disk is waited for
            hold_up=PATIENCE if isinstance(rig.clock, VirtualClock) else 0.0,
        )
        points = _Points()
        stream = Stream(rig.clock, [recorder, points, *subscribers])
        status, reason = "failed", "the program failed"
        try:
            opened(rig)
            signals = SignalMap(rig.channels, configuration.laser_reference, configuration.calibrated)
            engine = Engine(
                rig,
                Guard(
                    rig, configuration.limits, configuration.ramps, configuration.mover, signals, configuration.channels
                ),
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
                ending = engine.run(prepared.plan())
            status, reason = ending.status, ending.reason
        finally:
            recorder.close(status, reason)
    finally:
        rig.close()
    result = result_of(engine.returned, prepared, points.all)
    figures = [out / name for name in protocol.figures if name in result.figures]
    summary = Summary(
        protocol=protocol.name,
        status=ending.status,
        points=points.all,
        file=out / FILE,
        figure=figures[0] if figures else None,
        reason=ending.reason,
        software=f"rocking-bench {software()['rocking-bench']}",
        seed=configuration.seed,
        elapsed=time.monotonic() - started,
        bench_time=stream.now(),
        plan_hash=preflight.plan_hash,
        further_figures=figures[1:],
        findings=result.findings if result.passed is None else {"passed": result.passed, **result.findings},
    )
    write_summary(out / SUMMARY, summary)
    # first what other runs load: a figure that cannot be drawn costs no result
    for name in protocol.files:
        if name in result.files:
            result.files[name](out / name)
    if not requests.interrupted:
        # who interrupts does not wait for pictures: `rockbench report` draws them from the file
        with requests.without_rig():
            progress("drawing the figures")
            for path in figures:
                result.figures[path.name](path)
    return SessionResult(
        status=ending.status,
        reason=ending.reason,
        cause=ending.cause,
        summary=summary.as_dict(),
        table=result.text,
        interrupted=requests.strongest is not None,
        passed=result.passed is not False,
    )


def result_of(returned: object, prepared: Prepared[Any], points: Sequence[Parameters]) -> Result:
    """The result that a plan has `returned`, or that of a run which broke off with these `points`."""
    return returned if isinstance(returned, Result) else prepared.result(points)


def _metadata(protocol: Protocol[Any], parameters: Parameters, configuration: BenchConfiguration) -> dict[str, str]:
    return {
        "protocol": protocol.name,
        "parameters": parameters.model_dump_json(),
        "configuration": configuration.model_dump_json(),
        "specimen": configuration.known_specimen.model_dump_json(),
        **({} if configuration.seed is None else {"seed": str(configuration.seed)}),
        **software(),
        "git": revision(),
    }
