"""How a run ends, and how an ending is reported when more than one thing went wrong."""

from dataclasses import dataclass, field

from sim.errors import UNKNOWN, Cause, RockbenchError

SEVERITY = ("completed", "stopped", "aborted", "halted", "failed")
"""Every status, the worst last."""


@dataclass(frozen=True)
class Ending:
    """How a session ended: `status` is completed, stopped, aborted, halted or failed, with the reason and its cause."""

    status: str
    reason: str
    cause: Cause = field(default=UNKNOWN, compare=False)

    @classmethod
    def failed(cls, error: RockbenchError) -> "Ending":
        """The ending that an error makes."""
        return cls("failed", str(error), error.cause)

    def then(self, later: "Ending | None") -> "Ending":
        """This ending with what came on top while the bench was brought to rest: the worse status, both reasons.

        The cause stays that of the first.
        """
        if later is None:
            return self
        status = max(self.status, later.status, key=SEVERITY.index)
        return Ending(status, f"{self.reason}; then {later.reason}", self.cause)


class Ended(Exception):
    """The plan is over before its end."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending.reason)
        self.ending = ending
