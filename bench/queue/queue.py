"""The list of tests, and what may be done with it."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from bench.queue.queued import OPEN, Queued, Stage
from sim.errors import InvalidInput

Keep = Callable[[Sequence[Queued]], None]
"""Keeps the tests, in a file or on a screen."""

MOST_COPIES = 100


def _forget(tests: Sequence[Queued]) -> None: ...


class Queue:
    """Tests in the order in which they run. Each change but an end is handed to `keep` before it counts: one that
    cannot be kept raises what `keep` raises, and leaves the queue as it was.

    Indices count from 0, numbers in messages from 1.
    """

    def __init__(self, tests: Iterable[Queued] = (), keep: Keep = _forget) -> None:
        self._tests, self._keep = tuple(tests), keep

    @property
    def tests(self) -> tuple[Queued, ...]:
        """All tests, those that are over included."""
        return self._tests

    @property
    def next(self) -> int | None:
        """Index of the first test that waits."""
        return next((i for i, test in enumerate(self._tests) if test.stage is Stage.WAITING), None)

    @property
    def running(self) -> int | None:
        """Index of the test that runs."""
        return next((i for i, test in enumerate(self._tests) if test.stage is Stage.RUNNING), None)

    @property
    def waiting(self) -> int:
        """How many tests wait."""
        return sum(test.stage is Stage.WAITING for test in self._tests)

    def add(self, test: Queued) -> None:
        """At the end."""
        self._change([*self._tests, test])

    def replace(self, index: int, test: Queued) -> None:
        """Another test in place of one that has not begun. Raises InvalidInput for one that has."""
        self._open(index, "edited")
        self._set(index, test)

    def remove(self, index: int) -> None:
        """Any test but the one that runs."""
        if self._tests[index].stage is Stage.RUNNING:
            raise _refused(index, self._tests[index], "it is running: stop it first")
        self._change([*self._tests[:index], *self._tests[index + 1 :]])

    def move(self, index: int, by: int) -> int:
        """A test that has not begun, `by` places down (up below zero), not past an end; returns where it is then."""
        test = self._open(index, "moved")
        rest = [*self._tests[:index], *self._tests[index + 1 :]]
        place = min(max(index + by, 0), len(rest))
        self._change([*rest[:place], test, *rest[place:]])
        return place

    def skip(self, index: int) -> None:
        """Leave out a test that has not begun; one that is left out is taken in again."""
        test = self._open(index, "skipped")
        self._set(index, test, stage=Stage.WAITING if test.stage is Stage.SKIPPED else Stage.SKIPPED)

    def repeat(self, index: int, times: int = 1) -> None:
        """Copies below a test, whatever became of it; each waits, and has a folder of its own."""
        if not 1 <= times <= MOST_COPIES:
            raise InvalidInput("times", times, f"a whole number at least 1 and at most {MOST_COPIES}")
        original, folders = self._tests[index], {test.out for test in self._tests}
        copies: list[Queued] = []
        for _ in range(times):
            out = _another(original.out, folders)
            folders.add(out)
            copies.append(original.model_copy(update={"out": out, "stage": Stage.WAITING, "told": ""}))
        self._change([*self._tests[: index + 1], *copies, *self._tests[index + 1 :]])

    def begin(self, index: int, out: str) -> None:
        """The test runs, its results go to `out`."""
        self._open(index, "begun")
        self._set(index, self._tests[index], stage=Stage.RUNNING, out=out, told="")

    def finish(self, index: int, *, good: bool, told: str) -> None:
        """The test is over, or was refused before it began; so it is, whether that can be kept or not."""
        ended = {"stage": Stage.DONE if good else Stage.FAILED, "told": told}
        test = self._tests[index].model_copy(update=ended)
        self._tests = (*self._tests[:index], test, *self._tests[index + 1 :])
        self._keep(self._tests)

    def _open(self, index: int, what: str) -> Queued:
        test = self._tests[index]
        if test.stage not in OPEN:
            raise _refused(index, test, f"it cannot be {what} any more; repeat it, and a copy waits")
        return test

    def _set(self, index: int, test: Queued, **changed: Any) -> None:
        self._change([*self._tests[:index], test.model_copy(update=changed), *self._tests[index + 1 :]])

    def _change(self, tests: Sequence[Queued]) -> None:
        self._keep(tests)
        self._tests = tuple(tests)


def _refused(index: int, test: Queued, allowed: str) -> InvalidInput:
    return InvalidInput(f"test {index + 1}", str(test.stage), allowed)


def _another(folder: str | None, taken: set[str | None]) -> str | None:
    """A folder beside `folder` that no test has: `name-2`, `name-3`, ..."""
    if folder is None:
        return None
    number = 2
    while (name := f"{folder}-{number}") in taken:
        number += 1
    return name
