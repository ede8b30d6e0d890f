"""Which sensors there are on the serial ports of this machine."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import RigError
from drivers.optoncdt.dialogue import Dialogue
from drivers.optoncdt.info import SensorInfo
from drivers.optoncdt.port import FACTORY_BAUD, listed_ports, open_port
from drivers.optoncdt.search import asked
from sim.sweep import in_threads


@dataclass(frozen=True)
class FoundLaser:
    """One serial port: the sensor on it and its baud rate, or else the reason why there is none to be used."""

    port: str
    baud: int | None
    info: SensorInfo | None
    problem: str | None


def find_lasers(ports: Sequence[str] | None = None) -> list[FoundLaser]:
    """Ask on each of `ports`, or of all ports that the system lists, who is there.

    Only questions are asked, at each baud rate that a sensor may have: no setting of a sensor is changed, and one that
    streams goes on doing so. Takes about 4 s, for all ports at once.
    """
    names = list(dict.fromkeys(listed_ports() if ports is None else ports))
    if not names:
        return []
    return in_threads(_probed, names, threads=len(names))


def _probed(port: str) -> FoundLaser:
    try:
        with open_port("the port", port, FACTORY_BAUD) as opened:
            answer = asked(Dialogue(port, opened))
    except RigError as error:
        return FoundLaser(port, None, None, str(error))
    if answer is None:
        silent = "no sensor answers at any baud rate; check its power and the two RS422 pairs"
        return FoundLaser(port, None, None, silent)
    problem = None if answer.info.supported else "not an ILD1420: this driver does not know its values"
    return FoundLaser(port, answer.baud, answer.info, problem)
