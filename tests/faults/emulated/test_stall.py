"""The whole program is stopped for a second while it records: no laser value is lost, and the cause is named."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.datafile.reader import DataFile, open_datafile
from tests.emulated import emulated
from tests.lateness import Lateness
from tests.patience import LONG

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs pseudo-terminals, and signals that stop a process")

STALL, ACQUIRED = 1.0, 3.0
CLIENT = """
import sys
from pathlib import Path
from bench.config.model import BenchConfiguration
from bench.datafile.recorder import Recorder
from bench.engine.engine import configured_engine
from bench.engine.interface import EventStream, Requests, Unattended
from bench.engine.steps import AcquireAtRest
from bench.events import Acquired
from drivers.hardware.rig import HardwareRig
from tests.faults.setup import NoPoint

given = BenchConfiguration.model_validate_json(sys.stdin.readline())

def began(event):
    if isinstance(event, Acquired) and event.block.first == 0:
        print("began", flush=True)

def plan():
    yield AcquireAtRest(%s)

with HardwareRig(given.hardware, lead=given.lead_samples) as rig:
    recorder = Recorder(Path(sys.argv[1]), channels=rig.channels, sample_rate=rig.sample_rate,
                        point_type=NoPoint, metadata={})
    engine = configured_engine(rig, given, EventStream(rig.clock, [recorder, began]), Requests(), Unattended())
    ending = engine.run(plan())
    recorder.close(ending.status, ending.reason)
"""


@pytest.fixture(scope="module")
def configuration() -> Iterator[BenchConfiguration]:
    with emulated("--lasers", "serial") as given:
        lasers = given.hardware.lasers.model_copy(update={"observation_time": 1.5})
        daq = given.hardware.daq.model_copy(update={"watchdog": 3.0, "timeout_margin": 2.0})
        hardware = given.hardware.model_copy(update={"lasers": lasers, "daq": daq})
        yield given.model_copy(
            update={"hardware": hardware, "limits": given.limits.model_copy(update={"late": 3.0, "sensor_loss": 3.0})}
        )


def stalled(configuration: BenchConfiguration, lead: float, path: Path) -> None:
    """Record, and stop the process for a second in between."""
    acquisition = configuration.acquisition.model_copy(update={"lead": lead})
    given = configuration.model_copy(update={"acquisition": acquisition})
    command = [sys.executable, "-c", CLIENT % ACQUIRED, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdin is not None
        assert client.stdout is not None
        client.stdin.write(given.model_dump_json() + "\n")
        client.stdin.flush()
        assert client.stdout.readline() == "began\n"
        time.sleep(1.0)
        # the process alone, as a debugger or an exhausted memory would
        client.send_signal(signal.SIGSTOP)
        time.sleep(STALL)
        client.send_signal(signal.SIGCONT)
        assert client.wait(LONG) == 0


def lost_values(record: DataFile) -> dict[str, int]:
    """Missing measurements of each laser from its first to its last recorded one; both were recorded for 2 s at least.

    The stall is in the middle: the lasers have 4 kHz.
    """
    found: dict[str, int] = {}
    for name in ("laser_1", "laser_2"):
        index = record.raw_values(name, 1).index
        assert index[-1] - index[0] > 4000 * (1.0 + STALL)
        found[name] = int(np.sum(np.diff(index) - 1))
    return found


@pytest.mark.parametrize(("lead", "status"), [(2.0, "completed"), (0.1, "failed")])
def test_a_stall_of_the_whole_process_loses_no_raw_value_and_is_named(
    configuration: BenchConfiguration, lead: float, status: str, tmp_path: Path
) -> None:
    path = tmp_path / "campaign.h5"
    with Lateness() as lateness:
        stalled(configuration, lead, path)
    with open_datafile(path) as record:
        told = record.summary + " ".join(event.text for event in record.events)
        try:
            assert record.status == status
            assert lost_values(record) == {"laser_1": 0, "laser_2": 0}
        except AssertionError:
            if (excuse := lateness.excuse) is not None:
                pytest.skip(excuse)
            raise
        seconds = re.search(r"the operating system did not run this program for ([\d.]+) s", told)
        assert seconds is not None, told
        assert float(seconds[1]) == pytest.approx(STALL, abs=0.5)
        if status == "completed":
            late = np.isnan(record.values("laser_1")).sum()
            again = record.resampled("laser_1", 1)
            # the values that were late are found again; only the ends of the run have none
            assert np.isnan(again).sum() <= late
            assert np.isfinite(again[200:-400]).all()
