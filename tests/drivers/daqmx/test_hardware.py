"""A real NI device, a few millivolts and nothing connected: run with `pytest -m ni_hardware`.

The device is named by environment variables: ROCKBENCH_NI_INPUTS and ROCKBENCH_NI_OUTPUT (physical channels, several
inputs separated by commas), and where there are such things ROCKBENCH_NI_LINE, ROCKBENCH_NI_WATCHDOG (seconds) and
ROCKBENCH_NI_SERVER (host:port).
"""

import os
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.daqmx.devices import find_devices
from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.errors import DriveUnderflow

RATE, LEAD, BLOCK = 2000.0, 400, 200

pytestmark = pytest.mark.ni_hardware


@pytest.fixture(autouse=True)
def _asked_for(request: pytest.FixtureRequest) -> None:
    if "ni_hardware" not in str(request.config.option.markexpr):
        pytest.skip("needs an NI device: run with -m ni_hardware")
    if "ROCKBENCH_NI_OUTPUT" not in os.environ or "ROCKBENCH_NI_INPUTS" not in os.environ:
        pytest.skip("needs ROCKBENCH_NI_INPUTS and ROCKBENCH_NI_OUTPUT: the physical channels to use")


@pytest.fixture
def session() -> Iterator[DaqSession]:
    given = os.environ.get
    watchdog = given("ROCKBENCH_NI_WATCHDOG")
    daq = Daq(
        server=given("ROCKBENCH_NI_SERVER"),
        output=os.environ["ROCKBENCH_NI_OUTPUT"],
        enable_line=given("ROCKBENCH_NI_LINE"),
        watchdog=float(watchdog) if watchdog else None,
        timeout_margin=5.0,
    )
    inputs = [AnalogInput(terminal=name.strip()) for name in os.environ["ROCKBENCH_NI_INPUTS"].split(",")]
    with DaqSession(daq, inputs, RATE, LEAD) as session:
        yield session


def started(session: DaqSession) -> None:
    session.prepare()
    session.write(np.zeros(LEAD))
    session.start()


def test_the_device_is_listed(session: DaqSession) -> None:
    names = [device.name.lower() for device in find_devices(os.environ.get("ROCKBENCH_NI_SERVER"))]
    assert os.environ["ROCKBENCH_NI_OUTPUT"].split("/")[0].lower() in names
    assert session.sample_rate == pytest.approx(RATE, rel=1e-9)
    assert all(scaling.coefficients[1] != 0.0 for scaling in session.scalings)


def test_a_second_of_silence_is_played_and_read_twice(session: DaqSession) -> None:
    for _ in range(2):
        started(session)
        for _ in range(round(RATE / BLOCK)):
            session.write(np.zeros(BLOCK))
            assert session.read(BLOCK).shape == (BLOCK, len(session.scalings))
        assert session.acquired() >= RATE
        session.stop()


def test_a_drive_that_runs_dry_is_an_error(session: DaqSession) -> None:
    started(session)
    session.read(LEAD + BLOCK)
    with pytest.raises(DriveUnderflow):
        session.write(np.zeros(BLOCK))


def test_the_line_is_cut_at_any_time(session: DaqSession) -> None:
    started(session)
    assert session.cut() is ("ROCKBENCH_NI_LINE" in os.environ)
