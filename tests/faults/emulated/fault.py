"""A fault of the emulated laboratory: where it can strike, whether it did, and what it leaves out of reach."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from bench.events import State
from drivers.emulation.wiring import Connection
from tests.faults.emulated.bench import WiredBench
from tests.faults.fault import Fault
from tests.faults.places import ORDER, Place, lasting

Reach = Callable[[Place], bool]


def anywhere(place: Place) -> bool:  # noqa: ARG001 - the signature is that of every reach
    """A person, or what is a fault by being there."""
    return True


def while_read(place: Place) -> bool:
    """There are blocks to come."""
    return place.state not in (State.HALTED, State.CLOSED) and place.name != "idle at the end"


def while_driven(place: Place) -> bool:
    """A driven test is still to come, or goes on."""
    return lasting(place)


def before(name: str) -> Reach:
    """In whatever leads to the place of that name, which nobody's request has ended."""
    return lambda place: place.asked is None and ORDER[place.name] <= ORDER[name]


@dataclass(frozen=True)
class WiredFault(Fault):
    """Wherever `reach` says so it must strike, and `fired` tells whether it did: one that did not is lost.

    After an `unreachable` one nobody reaches the output stage any more, which holds its last value: only `watchdog`
    and `heartbeat`, those that there are, can open the enable chain, and must in time.
    """

    connection: Connection = "analogue"
    reach: Reach = while_read
    fired: Callable[[WiredBench], bool] = lambda bench: bench.begun
    unreachable: bool = False
    watchdog: bool = True
    heartbeat: bool = True


def wired(fault: Fault, **more: Any) -> WiredFault:
    """A fault of the catalogue of the simulated bench, on the emulated one."""
    return WiredFault(**{one.name: getattr(fault, one.name) for one in fields(Fault)}, **more)


def on(place: Place, bench: object) -> bool:  # noqa: ARG001
    """Wherever it strikes it must be noticed."""
    return True


def armed(place: Place, bench: object) -> bool:  # noqa: ARG001
    """The rig is armed and its clock runs."""
    return place.turn > 0 and place.state in (State.ARMED, State.RUNNING, State.STOPPING, State.ABORTING)


def struck(bench: WiredBench) -> bool:
    """Something in the program failed as it was told to."""
    return bool(bench.rig.struck)
