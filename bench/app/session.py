"""A campaign from configuration to result files: rig, guard, engine, recorder and summary."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.app.preflight import compile_run
from bench.app.support.awake import awake
from bench.config.model import BenchConfiguration
from bench.datafile.recorder import PATIENCE, Recorder
from bench.datafile.samples import CHUNK_TIME, VIRTUAL_CHUNK_TIME
from bench.engine.engine import configured_engine
from bench.engine.interface import Ending, EventStream, Operator, Requests
from bench.events import Subscriber, Warned
from bench.figures.summary import Summary, write_summary
from bench.plugins import plugin_code, plugin_generator
from bench.progress import Progress, silent
from bench.protocol import Prepared, Protocol, Result
from bench.provenance import revision, software
from bench.results import FILE, SUMMARY
from bench.rigs import open_rig, require_drivers
from bench.twin.live import live_twin
from drivers.clock import VirtualClock
from drivers.errors import RigError
from drivers.rig import Rig
from sim.errors import UNKNOWN, Cause
from sim.parameters import Parameters


@dataclass(frozen=True)
class SessionResult:
    """Result of a campaign.

    summary : contents of the summary file, which can be converted to JSON.
    table : text for the terminal.
    interrupted : whether a person or a client ended the campaign.
    passed : verdict of a protocol that tests the bench; True for any other protocol.
    cause : cause of the end.
    """

    status: str
    reason: str
    summary: dict[str, object]
    table: str
    interrupted: bool
    passed: bool = True
    cause: Cause = UNKNOWN


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
    opened: Callable[[Rig, Subscriber], None] = lambda _rig, _publish: None,
    progress: Progress = silent,
) -> SessionResult:
    """Run a `prepared` protocol on its bench; write data file, figures and summary to the folder `out`.

    opened : called before the table moves, with the rig and a function that publishes an event of the run; both may be
        used only while the engine calls a subscriber.
    about : name of the operator and notes, stored in the data file with the metadata of the run.
    progress : receives the stages before the rig is opened and after it is closed.

    Raises InvalidInput before the table moves, and KeyboardInterrupt if an end is requested before the data file is
    created. Once the rig is armed, every ending of the motion is a result with a status; an error while result files
    are written is raised.
    """
    started = time.monotonic()
    name = f"the protocol {protocol.name}"
    with requests.without_rig():
        if requests.strongest is not None:
            raise KeyboardInterrupt
        require_drivers(prepared.configuration)
        with plugin_code(name, files=True):
            preflight = compile_run(protocol.name, prepared, out, progress)
        preflight.require()
        # the pace is set only after the plan is hashed, because the hash must not depend on it
        configuration = prepared.configuration.at_pace(realtime=realtime)
        progress("predicting the results")
        with plugin_code(name):
            prediction = {"prediction": prepared.prediction} if prepared.prediction else {}
            sources, events = prepared.sources, protocol.event_types
        tables = {**prediction, **preflight.tables, **sources}
        metadata = _metadata(protocol, prepared.parameters, configuration)
        metadata |= {"plan_hash": preflight.plan_hash, **(about or {})}
    if requests.strongest is not None:
        raise KeyboardInterrupt
    rig = open_rig(configuration, realtime=realtime)
    held = ExitStack()
    try:
        virtual = isinstance(rig.clock, VirtualClock)
        if not virtual:
            held.enter_context(awake())
        # opening the rig may take long: an end requested meanwhile leaves neither folder nor file
        if requests.strongest is not None:
            raise KeyboardInterrupt
        out.mkdir(parents=True, exist_ok=True)
        recorder = Recorder(
            out / FILE,
            channels=rig.channels,
            sample_rate=rig.sample_rate,
            point_type=protocol.point,
            events=events,
            metadata=metadata | {"devices": json.dumps(rig.description), "lead": str(rig.lead)},
            tables=tables,
            # virtual time does not advance while waiting for the disk
            hold_up=PATIENCE if virtual else 0.0,
            chunk_time=VIRTUAL_CHUNK_TIME if virtual else CHUNK_TIME,
        )
        stream = EventStream(rig.clock, [recorder, *subscribers], recorder.stores)
        status, reason = "failed", "the program failed"
        try:
            opened(rig, stream.publish)
            engine = configured_engine(rig, configuration, stream, requests, operator)
            strange = configuration.calibrated.strange(rig.description) if configuration.calibrated else ()
            for warning in (*strange, *preflight.warnings):
                stream.publish(Warned(warning))
            # in virtual time the bench waits while the model computes
            patient = virtual
            with live_twin(stream, rig, configuration, requests, patient=patient):
                ending = engine.run(plugin_generator(name, prepared.plan()))
            ending = ending.then(_closing(rig))
            status, reason = ending.status, ending.reason
        finally:
            recorder.close(status, reason)
    finally:
        _closing(rig)
        held.close()
    with plugin_code(name):
        result = result_of(engine.returned, prepared, stream.points)
    # no figures are drawn after an interrupt; `rockbench report` draws them from the file
    drawn = () if requests.interrupted else protocol.figures
    figures = [out / file for file in drawn if file in result.figures]
    summary = Summary(
        protocol=protocol.name,
        status=ending.status,
        points=stream.points,
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
    # the protocol's result files come first: a failing figure must not prevent a result
    with plugin_code(name, files=True):
        for file in protocol.files:
            if file in result.files:
                result.files[file](out / file)
    if not requests.interrupted:
        with requests.without_rig(), plugin_code(name, files=True):
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


def _closing(rig: Rig) -> Ending | None:
    """Close the rig. Returns a failed ending if an error occurs, else None."""
    try:
        rig.close()
    except RigError as error:
        return Ending.failed(error)
    return None


def result_of(returned: object, prepared: Prepared[Any], points: Sequence[Parameters]) -> Result:
    """The result `returned` by a plan, or the result of an interrupted run with these `points`."""
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
