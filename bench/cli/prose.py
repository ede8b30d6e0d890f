"""The documentation of a command as its help says it."""

from collections.abc import Callable
from inspect import getdoc
from typing import Any


def prose(command: Callable[..., Any]) -> str:
    """Each paragraph of the command's documentation as one line, which the terminal breaks where it ends."""
    return "\n\n".join(" ".join(each.split()) for each in (getdoc(command) or "").split("\n\n"))
