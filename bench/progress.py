"""Progress of a computation, reported through a callable."""

from collections.abc import Callable
from typing import Protocol


class Progress(Protocol):
    """Callable that long computations call in the thread of their caller."""

    def __call__(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """Report `phase`, the present stage, of which `done` of `total` parts are complete, if countable."""
        ...


def silent(phase: str, done: int = 0, total: int = 0, /) -> None:
    """Discard the progress."""


def counting(progress: Progress, phase: str) -> Callable[[int, int], None]:
    """Report `phase` now, and return a callable that reports how many of its parts are done: `(done, total)`."""
    progress(phase)
    return lambda done, total: progress(phase, done, total)
