"""One test of a queue."""

from enum import StrEnum
from typing import Any

from sim.parameters import Parameters, quantity


class Stage(StrEnum):
    """What has become of a test."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    """It was refused, or did not come to a good end."""
    SKIPPED = "skipped"


OPEN = (Stage.WAITING, Stage.SKIPPED)
"""Stages of tests that have not begun."""


class Queued(Parameters):
    """A protocol and what is asked of it. The bench it runs on is that of whoever runs the queue."""

    protocol: str = quantity(..., "", "protocol, by its name on the command line")
    parameters: dict[str, Any] = quantity({}, "", "its parameters, as in a protocol file; defaults may be left out")
    out: str | None = quantity(None, "", "folder for the results; absent: one of its own, named when it begins")
    operator: str = quantity("", "", "who runs it")
    note: str = quantity("", "", "something to remember")
    realtime: bool = quantity(False, "", "whether the simulated bench runs at the pace of the clock")
    ask: bool = quantity(False, "", "whether a person is asked even where the bench does the hand work by itself")
    unattended: bool = quantity(False, "", "whether every question is answered with yes, as by --yes")
    keep_going: bool = quantity(False, "", "whether it goes on to its end when the window is gone")
    stage: Stage = quantity(Stage.WAITING, "", "what has become of it")
    told: str = quantity("", "", "how it ended, or why it was refused")

    @property
    def about(self) -> dict[str, str]:
        """What is kept in the data file about the run and changes nothing in it."""
        return {name: text for name, text in (("operator", self.operator), ("notes", self.note)) if text}
