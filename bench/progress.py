"""How far a computation is: a callable that is handed down to it, and by which it reports."""

from collections.abc import Callable
from typing import Protocol


class Progress(Protocol):
    """Called by what may take long, in the thread that waits for it."""

    def __call__(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """`phase` is what is being done, in words; `done` of its `total` parts are, where those can be counted."""
        ...


def silent(phase: str, done: int = 0, total: int = 0, /) -> None:
    """Report to nobody."""


def counting(progress: Progress, phase: str) -> Callable[[int, int], None]:
    """Report `phase` now, and return what counts its parts: called with how many of all are done."""
    progress(phase)
    return lambda done, total: progress(phase, done, total)
