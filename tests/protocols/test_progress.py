"""The progress of runs whose own tests start them as commands; other tests of a run look at its events."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench.app.catalogue import load_protocol
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.engine.interface import Requests, Unattended
from bench.events import Acquired, Event
from protocols.check.protocol import CheckParameters
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from sim.parameters import Parameters
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent

RUNS: dict[str, Parameters] = {
    "check": CheckParameters(cycles=4, rest=1.0),
    "laser-calibration": LaserCalibrationParameters(passes=6, cycles=4),
}


@pytest.mark.parametrize("name", RUNS)
def test_the_progress_of_a_completed_run_ends_at_100_percent(name: str, tmp_path: Path) -> None:
    protocol = load_protocol(name)
    bench = VirtualBenchParameters(sample_rate=1000.0)
    configuration = BenchConfiguration(acquisition=Acquisition(block_duration=0.2), simulation=Simulation(bench=bench))
    events: list[Event] = []
    result = run_session(
        replace(protocol, figures=()),
        protocol.prepare(RUNS[name], configuration, None),
        out=tmp_path / "run",
        operator=Unattended(),
        subscribers=[lambda event: None if isinstance(event, Acquired) else events.append(event)],
        requests=Requests(),
        realtime=False,
    )
    assert result.status == "completed", result.reason
    ends_at_100_percent(events)
