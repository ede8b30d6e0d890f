"""The person at the bench, as the engine knows one: is asked to do something, and says whether it is done."""

from dataclasses import dataclass
from typing import Protocol


class Operator(Protocol):
    """Whoever does what only a hand can do between two tests."""

    @property
    def name(self) -> str:
        """Who answers, for the record."""
        ...

    def confirm(self, request: str) -> bool:
        """Return True when `request` has been done, False when it is declined: the run then ends. May wait long."""
        ...


@dataclass(frozen=True)
class Unattended:
    """Says yes to everything at once: for a simulated bench, which does the hand work itself, and for tests."""

    name: str = "unattended run"

    def confirm(self, request: str) -> bool:  # noqa: ARG002 - every request has the same answer
        return True
