"""Campaigns recorded without a session around them, for tests of what reads them."""

from collections.abc import Sequence
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.datafile.recorder import Recorder
from bench.engine.engine import configured_engine
from bench.engine.interface import Ending, EventStream, Operator, Requests, Unattended
from bench.engine.steps import Plan
from bench.events import Event, Subscriber
from bench.twin.live import live_twin
from drivers.rig import Rig
from sim.parameters import Parameters


def recorded(
    path: Path,
    plan: Plan,
    rig: Rig,
    configuration: BenchConfiguration,
    point_type: type[Parameters],
    metadata: dict[str, str] | None = None,
    requests: Requests | None = None,
    operator: Operator | None = None,
    subscribers: Sequence[Subscriber] = (),
    first: Sequence[Event] = (),
    events: Sequence[type[Event]] = (),
) -> Ending:
    """Carry out `plan` on `rig` and leave the file at `path`; `first` is said before.

    `events` are those of the protocol.
    """
    recorder = Recorder(
        path,
        channels=rig.channels,
        sample_rate=rig.sample_rate,
        point_type=point_type,
        metadata={"configuration": configuration.model_dump_json(), **(metadata or {})},
        events=events,
        hold_up=60.0,
    )
    stream, requests = EventStream(rig.clock, [recorder, *subscribers]), requests or Requests()
    engine = configured_engine(rig, configuration, stream, requests, operator or Unattended())
    for event in first:
        stream.publish(event)
    with live_twin(stream, rig, configuration, requests, patient=True):
        ending = engine.run(plan)
    recorder.close(ending.status, ending.reason)
    return ending
