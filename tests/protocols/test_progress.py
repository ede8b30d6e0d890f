"""The progress of a check, whose own tests start it as a command; other tests of a run look at its events."""

from pathlib import Path

from bench.app.catalogue import load_protocol
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from protocols.check.protocol import CheckParameters
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent, followed


def test_the_progress_of_a_completed_check_ends_at_100_percent(tmp_path: Path) -> None:
    protocol = load_protocol("check")
    bench = VirtualBenchParameters(sample_rate=1000.0)
    configuration = BenchConfiguration(acquisition=Acquisition(block_duration=0.2), simulation=Simulation(bench=bench))
    prepared = protocol.prepare(CheckParameters(cycles=4, rest=1.0), configuration, None)
    result, events = followed(protocol, prepared, tmp_path / "run")
    assert result.status == "completed", result.reason
    ends_at_100_percent(events)
