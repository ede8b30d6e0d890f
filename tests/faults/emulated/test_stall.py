"""The whole program is stopped for a second while it records: no laser value is lost, and the cause is named."""

import multiprocessing
import os
import re
import signal
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.recorder import Recorder
from bench.engine.engine import configured_engine
from bench.engine.interface import EventStream, Requests, Unattended
from bench.engine.steps import AcquireAtRest, Plan
from bench.events import Acquired, Event
from bench.guard.limits import Limits
from drivers.emulation.laboratory import Laboratory
from drivers.hardware.rig import HardwareRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.faults.setup import NoPoint
from tests.lateness import Lateness
from tests.patience import LONG

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs pseudo-terminals, and signals that stop a process")

STALL, ACQUIRED = 1.0, 3.0


@pytest.fixture(scope="module")
def configuration() -> Iterator[BenchConfiguration]:
    with Laboratory(VirtualBenchParameters(), Specimen(), seed=1, connection="serial") as laboratory:
        hardware = laboratory.hardware
        lasers = hardware.lasers.model_copy(update={"observation_time": 1.5})
        daq = hardware.daq.model_copy(update={"watchdog": 3.0, "timeout_margin": 2.0})
        yield BenchConfiguration(
            backend="hardware",
            hardware=hardware.model_copy(update={"lasers": lasers, "daq": daq}),
            limits=Limits(late=3.0, sensor_loss=3.0),
        )


def _plan() -> Plan:
    yield AcquireAtRest(ACQUIRED)


def _record(tell: Connection, given: BenchConfiguration, path: Path) -> None:
    """In the process that is stopped: a recording at rest; tells when it begins."""

    def began(event: Event) -> None:
        if isinstance(event, Acquired) and event.block.first == 0:
            tell.send("began")

    with HardwareRig(given.hardware, lead=given.lead_samples) as rig:
        recorder = Recorder(path, channels=rig.channels, sample_rate=rig.sample_rate, point_type=NoPoint, metadata={})
        stream = EventStream(rig.clock, [recorder, began])
        ending = configured_engine(rig, given, stream, Requests(), Unattended()).run(_plan())
        recorder.close(ending.status, ending.reason)


def stalled(configuration: BenchConfiguration, lead: float, path: Path) -> None:
    """Record, and stop the process for a second in between."""
    acquisition = configuration.acquisition.model_copy(update={"lead": lead})
    given = configuration.model_copy(update={"acquisition": acquisition})
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.faults.emulated.preload"])
    told, tell = context.Pipe(duplex=False)
    client = context.Process(target=_record, args=(tell, given, path), daemon=True)
    client.start()
    tell.close()
    assert told.recv() == "began"
    assert client.pid is not None
    time.sleep(1.0)
    # the process alone, as a debugger or an exhausted memory would
    os.kill(client.pid, signal.SIGSTOP)
    time.sleep(STALL)
    os.kill(client.pid, signal.SIGCONT)
    client.join(LONG)
    assert client.exitcode == 0


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
