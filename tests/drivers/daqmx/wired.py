"""A device with something on its digital lines."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.emulation.daqmx.lines import Wires
from drivers.emulation.daqmx.models import x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.safety_chain import PulseRelay
from sim.sensors import Converter
from tests.drivers.daqmx.loopback import BITS, RANGE, Loopback

ENABLE, HEARTBEAT = "Dev1/port0/line0", "Dev1/port0/line5"
LINES = {
    "emergency_stop": "Dev1/port0/line1",
    "over_travel": "Dev1/port0/line2",
    "over_travel_2": "Dev1/port0/line3",
    "amplifier_ready": "Dev1/port0/line4",
}
"""Safety inputs and the lines that they have by default."""
INPUTS = {name: {} for name in LINES}
"""All of them as the configuration gives them."""


class Contacts:
    """The levels of the input lines, and every level that the heartbeat line was given."""

    def __init__(self, timeout: float) -> None:
        self.levels = dict.fromkeys(LINES.values(), True)
        self.beats: list[bool] = []
        self.relay = PulseRelay(timeout)

    def beat(self, high: bool) -> None:
        self.beats.append(high)
        self.relay.level(high)


@contextmanager
def wired(plant: Loopback, contacts: Contacts) -> Iterator[DaqServer]:
    """A server whose input lines show `contacts` and whose enable line is the plant's."""
    wires = Wires(
        {ENABLE: plant.enable, HEARTBEAT: contacts.beat},
        {line: lambda line=line: contacts.levels[line] for line in LINES.values()},
    )
    with DaqServer(plant, [x_series()], converter=Converter(bits=BITS, range=RANGE), wires=wires) as server:
        yield server
