"""The progress of a check, whose own tests start it as a command; other tests of a run look at its events."""

from dataclasses import replace
from pathlib import Path

from bench.app.catalogue import load_protocol
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.engine.interface import Requests, Unattended
from bench.events import Acquired, Event
from protocols.check.protocol import CheckParameters
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent


def test_the_progress_of_a_completed_check_ends_at_100_percent(tmp_path: Path) -> None:
    protocol = load_protocol("check")
    bench = VirtualBenchParameters(sample_rate=1000.0)
    configuration = BenchConfiguration(acquisition=Acquisition(block_duration=0.2), simulation=Simulation(bench=bench))
    events: list[Event] = []
    result = run_session(
        replace(protocol, figures=()),
        protocol.prepare(CheckParameters(cycles=4, rest=1.0), configuration, None),
        out=tmp_path / "run",
        operator=Unattended(),
        subscribers=[lambda event: None if isinstance(event, Acquired) else events.append(event)],
        requests=Requests(),
        realtime=False,
    )
    assert result.status == "completed", result.reason
    ends_at_100_percent(events)
