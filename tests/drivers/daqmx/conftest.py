"""Emulated devices on a bench whose inputs are wired to its output."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from typing import Any

import pytest

from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.session import DaqSession
from drivers.emulation.daqmx.models import x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.errors import RigError
from drivers.timebase.marking import Pulses
from sim.sensors import Converter
from tests.drivers.daqmx.loopback import BITS, RANGE, Loopback
from tests.patience import eventually

RATE = 2000.0
LEAD = 100
INPUTS = tuple(AnalogInput(terminal=f"Dev1/ai{k}") for k in range(4))

OpenSession = Callable[..., DaqSession]


@pytest.fixture
def plant() -> Loopback:
    return Loopback(RATE)


@pytest.fixture
def server(plant: Loopback) -> Iterator[DaqServer]:
    with DaqServer(plant, [x_series()], converter=Converter(bits=BITS, range=RANGE)) as server:
        yield server


@pytest.fixture
def open_session(server: DaqServer) -> Iterator[OpenSession]:
    """Opens sessions on the server, `hardware.daq` as told; closes them, and sees that no thread is left."""
    before = set(threading.enumerate())
    with ExitStack() as opened:

        def open_session(
            *,
            inputs: tuple[AnalogInput, ...] = INPUTS,
            rate: float = RATE,
            lead: int = LEAD,
            pulses: Pulses | None = None,
            **daq: Any,
        ) -> DaqSession:
            session = DaqSession(Daq(**{"server": server.address} | daq), inputs, rate, lead, pulses)
            opened.callback(closed_whatever_it_says, session)
            return session

        yield open_session
    eventually(lambda: {each for each in threading.enumerate() if is_ours(each)} <= before)


@pytest.fixture
def session(open_session: OpenSession) -> DaqSession:
    return open_session()


def is_ours(thread: threading.Thread) -> bool:
    """Not one of the emulated server's own."""
    return not thread.name.startswith("emulated")


def closed_whatever_it_says(session: DaqSession) -> None:
    with suppress(RigError):
        session.close()
