"""How a run ends, and how an ending is told when more than one thing went wrong."""

from dataclasses import dataclass

SEVERITY = ("completed", "stopped", "aborted", "halted", "failed")
"""Every status, the worst last."""


@dataclass(frozen=True)
class Ending:
    """How a session ended: `status` is completed, stopped, aborted, halted or failed, with the reason."""

    status: str
    reason: str

    def then(self, later: "Ending | None") -> "Ending":
        """This ending with what came on top while the bench was brought to rest: the worse status, both reasons."""
        if later is None:
            return self
        return Ending(max(self.status, later.status, key=SEVERITY.index), f"{self.reason}; then {later.reason}")


class Ended(Exception):
    """The plan is over before its end."""

    def __init__(self, ending: Ending) -> None:
        super().__init__(ending.reason)
        self.ending = ending
