"""Runs that several tests need."""

import numpy as np
from numpy.typing import NDArray

from drivers.daqmx.session import DaqSession
from tests.drivers.daqmx.conftest import LEAD, RATE
from tests.drivers.daqmx.loopback import Loopback

BLOCK = 100


def started(session: DaqSession, volts: NDArray[np.float64] | None = None) -> DaqSession:
    """Running, with the lead written, or `volts`."""
    session.prepare()
    session.write(np.zeros(LEAD) if volts is None else volts)
    session.start()
    return session


def driving(session: DaqSession) -> DaqSession:
    """Running, with 3 V at the output and 2 s of it ahead: a loaded machine does not run dry."""
    started(session, np.full(round(2.0 * RATE), 3.0))
    session.read(BLOCK)
    return session


def is_safe(plant: Loopback) -> bool:
    """Relay open, nothing at the output."""
    return not plant.enabled and plant.present_output() == 0.0
