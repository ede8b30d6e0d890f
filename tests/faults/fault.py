"""A fault: how it is brought about, where it must be noticed, and how a run that meets it must end."""

from collections.abc import Callable
from dataclasses import dataclass

from bench.events import State
from drivers.errors import RigError
from tests.faults.bench import Begin, FaultyBench
from tests.faults.places import ORDER, Place, lasting
from tests.faults.rig import Failure
from tests.faults.samples import Making

Must = Callable[[Place, FaultyBench], bool]


def stays(place: Place, bench: FaultyBench) -> bool:  # noqa: ARG001 - the signature is that of every rule
    """A fault that stays must be noticed when a driven test is still to come."""
    return lasting(place)


def strikes(place: Place, bench: FaultyBench) -> bool:  # noqa: ARG001
    """A fault that happens once must be noticed when it happened."""
    return bool(bench.rig.struck)


def reads(place: Place, bench: FaultyBench) -> bool:  # noqa: ARG001
    """Something that every turn looks at must be noticed while there are turns to come."""
    return place.state not in (State.HALTED, State.CLOSED) and place.name != "idle at the end"


def heeded(place: Place, bench: FaultyBench) -> bool:
    """A request must be heeded while there is something to end; the fast ramp of a good test is not made faster."""
    return reads(place, bench) and (place.state is not State.ABORTING or place.asked is not None)


def answered(place: Place, bench: FaultyBench) -> bool:  # noqa: ARG001
    """What the operator does must be noticed when he is still to be asked."""
    return ORDER[place.name] <= ORDER["second waiting"]


def never(place: Place, bench: FaultyBench) -> bool:  # noqa: ARG001
    """What must be borne."""
    return False


@dataclass(frozen=True)
class Fault:
    """`begin` brings it about. Noticed, the run ends as `status`, and `says` is in the reason.

    Where several endings or words are right, `status` and `says` name them with bars between. `must` tells where the
    fault must be noticed; elsewhere it may be if `may`, and otherwise the run ends as if nothing had been.
    """

    name: str
    begin: Begin
    status: str
    says: str
    must: Must
    may: bool = False
    raises: type[BaseException] | None = None
    disobeys: bool = False
    """Nothing brings this rig to a stop but closing it."""
    moves: bool = False
    """The table moves more than it is told to."""
    recorded: bool = False
    """Whether the rig's list `struck` says that it struck."""
    disk: str = ""
    """What is the matter with the disk: "full", "hung" or "slow"."""


def of_samples(name: str, making: Making, status: str, says: str, must: Must, may: bool = False) -> Fault:
    """A fault of what is read, from its beginning on."""
    return Fault(
        name, lambda bench: bench.rig.falsify.append(making(bench.rig)), status, says, must, may, recorded=True
    )


def borne(name: str, making: Making) -> Fault:
    """A fault of what is read that must not end the run."""
    return of_samples(name, making, "completed", "", never)


def fails(
    name: str,
    call: str,
    error: RigError,
    times: float = 1,
    *,
    obeys: bool = False,
    must: Must = strikes,
    may: bool = False,
) -> Fault:
    """A call of the rig that raises."""

    def begin(bench: FaultyBench) -> None:
        bench.rig.failures[call] = Failure(error, times, obeys)

    return Fault(name, begin, "failed", str(error), must, may, recorded=True)


def asks(*requests: str, status: str, says: str = "requested", must: Must = heeded) -> Fault:
    """A person who asks for one or more endings at once."""

    def begin(bench: FaultyBench) -> None:
        for request in requests:
            getattr(bench.requests, request)()

    return Fault(f"{' and '.join(requests)} asked for", begin, status, says, must, True)
