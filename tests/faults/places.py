"""Where a fault begins: a state of the engine, which time it is entered, and the turn in it."""

from dataclasses import dataclass
from itertools import count

from bench.events import State


@dataclass(frozen=True)
class Place:
    """Before read `turn` of the `visit`-th time that the engine is in `state`; turn 0 is the change of state itself.

    `asked` is what a person asks for in turn `asked_in` of the first drive, where only that leads to the state.
    """

    name: str
    state: State
    visit: int = 1
    turn: int = 0
    asked: str | None = None
    asked_in: int = 3
    core: bool = True
    """Whether the test suite goes there; the others are left to the benchmark, which goes everywhere."""


PLACES = (
    Place("before anything", State.IDLE, 0),
    Place("first waiting", State.WAITING, core=False),
    Place("idle, answered", State.IDLE, core=False),
    Place("armed", State.ARMED, core=False),
    Place("at rest", State.ARMED, turn=2),
    Place("running", State.RUNNING, core=False),
    Place("following", State.RUNNING, turn=2),
    Place("dwelling", State.RUNNING, turn=5),
    Place("stopping", State.STOPPING, turn=1, core=False),
    Place("half stopped", State.STOPPING, turn=3),
    Place("idle between tests", State.IDLE, 2, core=False),
    Place("second waiting", State.WAITING, 2),
    Place("armed again", State.ARMED, 2, 1, core=False),
    Place("running again", State.RUNNING, 2, 3),
    Place("aborting", State.ABORTING, turn=1),
    Place("half aborted", State.ABORTING, turn=2),
    Place("idle at the end", State.IDLE, 4, core=False),
    Place("stop asked for", State.STOPPING, turn=2, asked="stop"),
    Place("abort asked for", State.ABORTING, turn=2, asked="abort"),
    Place("halted", State.HALTED, asked="halt"),
    Place("closed", State.CLOSED),
)

_order = count()
ORDER = {place.name: next(_order) for place in PLACES}
LAST_TEST = ORDER["running again"]
"""The last place from which a fault that stays is met by a driven test."""


def lasting(place: Place) -> bool:
    """Whether a fault that begins at `place` and stays is still there when the table is driven for a while."""
    return place.asked is None and ORDER[place.name] <= LAST_TEST
