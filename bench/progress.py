"""Progress of a computation, reported through a callable."""

from collections.abc import Callable
from typing import Protocol


class Progress(Protocol):
    """Callable to which a long computation reports its progress; it is called in the thread that started the
    computation.
    """

    def __call__(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """Report the current `phase`, with `done` of its `total` parts complete; `total` is 0 if unknown."""
        ...


def silent(phase: str, done: int = 0, total: int = 0, /) -> None:
    """Ignore all reports of progress."""


def counting(progress: Progress, phase: str) -> Callable[[int, int], None]:
    """Report `phase` and return a callable `(done, total)` that reports its completed parts."""
    progress(phase)
    return lambda done, total: progress(phase, done, total)
