"""A disk that is full, or hangs, between a recorder and its file."""

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Event as Flag
from time import monotonic, sleep

from bench.datafile.recorder import Recorder
from tests.patience import LONG

"""Longest wait for the recorder's thread [s]."""


@dataclass
class Disk:
    """What happens to writing: an error, or nothing at all until it is set free."""

    error: OSError | None = None
    free: Flag = field(default_factory=Flag)

    def __post_init__(self) -> None:
        self.free.set()

    def pass_(self) -> None:
        """Called ahead of whatever is written."""
        self.free.wait()
        if self.error is not None:
            raise self.error


def spoil(recorder: Recorder, disk: Disk) -> None:
    """Put `disk` between the recorder's thread and its file."""
    writer = recorder._writer  # pyright: ignore[reportPrivateUsage]

    def through(work: Callable[..., None]) -> Callable[..., None]:
        def passed(*args: object, **named: object) -> None:
            disk.pass_()
            work(*args, **named)

        return passed

    for name in ("add_block", "add_event", "commit"):
        setattr(writer, name, through(getattr(writer, name)))


def wait_until_broken(recorder: Recorder) -> None:
    """Return when the recorder's thread has met the error that waits for it."""
    deadline = monotonic() + LONG
    while recorder._failure is None:  # pyright: ignore[reportPrivateUsage]
        assert monotonic() < deadline, "the recorder does not notice that its disk is full"
        sleep(1e-4)
