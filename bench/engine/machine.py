"""The states of the bench and the only ways from one to another."""

from collections.abc import Callable

from bench.events import State

LEGAL: dict[State, frozenset[State]] = {
    State.IDLE: frozenset({State.ARMED, State.WAITING, State.HALTED, State.CLOSED}),
    State.WAITING: frozenset({State.IDLE, State.HALTED, State.CLOSED}),
    State.ARMED: frozenset({State.RUNNING, State.STOPPING, State.ABORTING, State.HALTED}),
    State.RUNNING: frozenset({State.STOPPING, State.ABORTING, State.HALTED}),
    State.STOPPING: frozenset({State.IDLE, State.ABORTING, State.HALTED}),
    State.ABORTING: frozenset({State.IDLE, State.HALTED}),
    State.HALTED: frozenset({State.CLOSED}),
    State.CLOSED: frozenset(),
}


class Machine:
    """Holds the state; `announce(before, after, reason)` is called at each change."""

    def __init__(self, announce: Callable[[State, State, str], None]) -> None:
        self._announce = announce
        self._state = State.IDLE

    @property
    def state(self) -> State:
        """Where the bench is."""
        return self._state

    def go(self, after: State, reason: str) -> None:
        """Change the state. An illegal transition is an error of the program: RuntimeError."""
        before = self._state
        if after not in LEGAL[before]:
            raise RuntimeError(f"the bench cannot go from {before} to {after} ({reason})")
        self._state = after
        self._announce(before, after, reason)
