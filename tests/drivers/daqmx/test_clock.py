"""Output and inputs on one sample clock, though the device's own clocks differ."""

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.models import compact_rio, x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import RigError
from sim.sensors import Converter
from tests.drivers.daqmx.conftest import RATE, OpenSession
from tests.drivers.daqmx.loopback import BITS, COUNTS_PER_VOLT, RANGE, Loopback
from tests.drivers.daqmx.runs import started

ERROR = 1.0 / 128.0
"""By how much the output's own clock is faster."""


@pytest.fixture
def server(plant: Loopback) -> Iterator[DaqServer]:
    converter = Converter(bits=BITS, range=RANGE)
    with DaqServer(plant, [x_series(), *compact_rio()], converter=converter, output_clock_error=ERROR) as server:
        yield server


def first_that_differs(session: DaqSession) -> int | None:
    """Which sample of the first input is not that of the drive, of 1000."""
    volts = np.random.default_rng(3).uniform(-9.0, 9.0, round(2.0 * RATE))
    counts = started(session, volts).read(1000)[:, 0]
    differ = np.flatnonzero(counts != np.round(COUNTS_PER_VOLT * volts[:1000]))
    return int(differ[0]) if differ.size else None


def test_the_output_keeps_up_with_the_inputs(open_session: OpenSession) -> None:
    session = open_session()
    assert session.description["sample clock of the output"] == "/Dev1/ai/SampleClock"
    assert first_that_differs(session) is None


def test_with_a_clock_of_its_own_it_does_not_and_the_session_says_which_it_has(open_session: OpenSession) -> None:
    session = open_session(clock="OnboardClock")
    assert session.description["sample clock of the output"] == "OnboardClock"
    # in the time of 128 samples it has played 129
    assert first_that_differs(session) == 128


def test_a_clock_of_another_device_is_refused_and_nothing_falls_back(open_session: OpenSession) -> None:
    session = open_session(clock="/cRIO1/it0/SampleClock")
    with pytest.raises(RigError, match=r"hardware\.daq\.clock"):
        started(session, np.zeros(200))
