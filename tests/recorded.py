"""Campaigns recorded without a session around them, for tests of what reads them."""

from collections.abc import Sequence
from pathlib import Path

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.ending import Ending
from bench.engine.engine import Engine
from bench.engine.operator import Operator, Unattended
from bench.engine.requests import Requests
from bench.engine.steps import Plan
from bench.engine.stream import Stream
from bench.events import Event, Subscriber
from bench.guard.guard import Guard
from bench.record.recorder import Recorder
from bench.twin.beside import twin_beside
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
) -> Ending:
    """Carry out `plan` on `rig` and leave the file at `path`; `first` is said before."""
    recorder = Recorder(
        path,
        channels=rig.channels,
        sample_rate=rig.sample_rate,
        point_type=point_type,
        metadata={"configuration": configuration.model_dump_json(), **(metadata or {})},
        hold_up=60.0,
    )
    stream, requests = Stream(rig.clock, [recorder, *subscribers]), requests or Requests()
    signals = SignalMap(rig.channels, configuration.laser_reference)
    engine = Engine(
        rig,
        Guard(rig, configuration.limits, configuration.ramps, configuration.mover, signals, configuration.channels),
        stream,
        requests,
        operator or Unattended(),
        configuration.block_samples,
    )
    for event in first:
        stream.publish(event)
    with twin_beside(stream, rig, configuration, requests, patient=True):
        ending = engine.run(plan)
    recorder.close(ending.status, ending.reason)
    return ending
