"""The progress of a run ends at its end: everything is done, and nothing is left."""

from pathlib import Path

import pytest

from bench.app.catalogue import load_protocol
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.engine.interface import Requests, Unattended
from bench.events import Event, Progress
from protocols.check.protocol import CheckParameters
from protocols.common.identification.parameters import IdentifyParameters
from protocols.coupling_stiffness.protocol import CouplingStiffnessParameters
from protocols.free_rocking.protocol import FreeRockingParameters
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from sim.parameters import Parameters
from sim.virtual_bench import VirtualBenchParameters

RUNS: dict[str, Parameters] = {
    "check": CheckParameters(),
    "laser-calibration": LaserCalibrationParameters(passes=6),
    "identify": IdentifyParameters(period=2.0, band_low=0.5, band_high=60.0, periods=2),
    "free-vibration": FreeVibrationParameters(repeats=2, window=10.0),
    "coupling-stiffness": CouplingStiffnessParameters(beta=(0.64,), repeats=2, window=10.0),
    "free-rocking": FreeRockingParameters(tilts=(0.5,)),
}


@pytest.mark.parametrize("name", RUNS)
def test_the_progress_of_a_completed_run_ends_at_100_percent(name: str, tmp_path: Path) -> None:
    protocol = load_protocol(name)
    configuration = BenchConfiguration(simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0)))
    told: list[Progress] = []

    def keep(event: Event) -> None:
        if isinstance(event, Progress):
            told.append(event)

    result = run_session(
        protocol,
        protocol.prepare(RUNS[name], configuration, None),
        out=tmp_path / "run",
        operator=Unattended(),
        subscribers=[keep],
        requests=Requests(),
        realtime=False,
    )
    assert result.status == "completed", result.reason
    assert all(-1e-9 <= each.fraction <= 1.0 + 1e-9 for each in told)
    assert all(each.remaining >= -1e-6 for each in told)
    # but for what a duration is longer than whole samples
    assert told[-1].fraction == pytest.approx(1.0, abs=1e-4)
    assert told[-1].remaining < 0.01
