"""The tests of a queue: listing, editing, and checking against a bench."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from pydantic import model_validator

from bench.app.catalogue import load_protocol
from bench.app.folders import check_folder, default_folder, make_folder, result_names
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

if TYPE_CHECKING:
    from bench.app.preflight import DiskSpace
    from bench.config.model import BenchConfiguration
    from bench.protocol import Prepared, Protocol


class Stage(StrEnum):
    """Status of a test."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    """The test was refused, did not complete, or did not pass."""
    SKIPPED = "skipped"


OPEN = (Stage.WAITING, Stage.SKIPPED)
"""Stages of tests that have not begun."""


class Queued(Parameters):
    """A queued test: a protocol with its parameters and options. The program that runs the queue determines the
    bench.
    """

    protocol: str = quantity(..., "", "protocol, by its command-line name")
    parameters: dict[str, Any] = quantity(
        {}, "", "parameters of the protocol, as in a protocol file; defaults may be omitted"
    )
    out: str | None = quantity(
        None, "", "folder for the results; if absent, a new folder is chosen when the test starts"
    )
    operator: str = quantity("", "", "name of the operator")
    note: str = quantity("", "", "note for the data file")
    realtime: bool = quantity(False, "", "whether the simulated bench runs in real time")
    ask: bool = quantity(False, "", "whether a person confirms operator tasks even if the bench can perform them")
    unattended: bool = quantity(False, "", "whether every question is answered yes, as with --yes")
    keep_going: bool = quantity(False, "", "whether the test continues to its end if the window closes")
    stage: Stage = quantity(Stage.WAITING, "", "status")
    outcome: str = quantity("", "", "outcome of the test, or reason for its refusal")

    @model_validator(mode="before")
    @classmethod
    def _accept_former_name(cls, content: Any) -> Any:
        """Files of the first edition call the outcome "told"."""
        if not isinstance(content, dict):
            return content
        return {"outcome" if key == "told" else key: value for key, value in cast(dict[str, Any], content).items()}

    @property
    def about(self) -> dict[str, str]:
        """Notes for the data file, which do not affect the run."""
        return {name: text for name, text in (("operator", self.operator), ("notes", self.note)) if text}


Keep = Callable[[Sequence[Queued]], None]
"""Callback that stores the tests, in a file or for a display."""

MOST_COPIES = 100


def _forget(tests: Sequence[Queued]) -> None: ...


class Queue:
    """Tests in the order of execution. Each change, except the end of a test, is passed to `keep` before it takes
    effect; an exception in `keep` is propagated and leaves the queue unchanged. Indices count from 0, numbers in
    messages from 1.
    """

    def __init__(self, tests: Iterable[Queued] = (), keep: Keep = _forget) -> None:
        self._tests, self._keep = tuple(tests), keep

    @property
    def tests(self) -> tuple[Queued, ...]:
        """All tests, including finished ones."""
        return self._tests

    @property
    def next(self) -> int | None:
        """Index of the first pending test; None if there is none."""
        return next((i for i, test in enumerate(self._tests) if test.stage is Stage.WAITING), None)

    @property
    def running(self) -> int | None:
        """Index of the running test; None if there is none."""
        return next((i for i, test in enumerate(self._tests) if test.stage is Stage.RUNNING), None)

    @property
    def waiting(self) -> int:
        """Number of pending tests."""
        return sum(test.stage is Stage.WAITING for test in self._tests)

    def add(self, test: Queued) -> None:
        """Append a test."""
        self._change([*self._tests, test])

    def replace(self, index: int, test: Queued) -> None:
        """Replace a test that has not begun; a skipped one remains skipped. Raises InvalidInput for one that has."""
        self._set(index, test, stage=self._open(index, "edited").stage)

    def remove(self, index: int) -> None:
        """Remove a test. Raises InvalidInput for the running one."""
        if self._tests[index].stage is Stage.RUNNING:
            raise _refused(index, self._tests[index], "the test is running: stop it first")
        self._change([*self._tests[:index], *self._tests[index + 1 :]])

    def move(self, index: int, by: int) -> int:
        """Move a test that has not begun down by `by` places (up if negative), at most to the end of the list; returns
        its new index.
        """
        test = self._open(index, "moved")
        rest = [*self._tests[:index], *self._tests[index + 1 :]]
        place = min(max(index + by, 0), len(rest))
        self._change([*rest[:place], test, *rest[place:]])
        return place

    def skip(self, index: int) -> None:
        """Skip a pending test, or restore a skipped one."""
        test = self._open(index, "skipped")
        self._set(index, test, stage=Stage.WAITING if test.stage is Stage.SKIPPED else Stage.SKIPPED)

    def repeat(self, index: int, times: int = 1) -> None:
        """Insert copies below a test of any status; each copy is pending and has a separate folder."""
        if not 1 <= times <= MOST_COPIES:
            raise InvalidInput("times", times, f"it must be an integer from 1 to {MOST_COPIES}")
        original, folders = self._tests[index], {test.out for test in self._tests}
        copies: list[Queued] = []
        for _ in range(times):
            out = _another(original.out, folders)
            folders.add(out)
            copies.append(original.model_copy(update={"out": out, "stage": Stage.WAITING, "outcome": ""}))
        self._change([*self._tests[: index + 1], *copies, *self._tests[index + 1 :]])

    def begin(self, index: int, out: str) -> None:
        """Mark a test as running, with its results in `out`."""
        self._open(index, "begun")
        self._set(index, self._tests[index], stage=Stage.RUNNING, out=out, outcome="")

    def finish(self, index: int, *, good: bool, outcome: str) -> None:
        """Mark a test as ended or refused, even if the change cannot be stored."""
        ended = {"stage": Stage.DONE if good else Stage.FAILED, "outcome": outcome}
        test = self._tests[index].model_copy(update=ended)
        self._tests = (*self._tests[:index], test, *self._tests[index + 1 :])
        self._keep(self._tests)

    def _open(self, index: int, what: str) -> Queued:
        test = self._tests[index]
        if test.stage not in OPEN:
            raise _refused(index, test, f"the test can no longer be {what}; repeat it to add a pending copy")
        return test

    def _set(self, index: int, test: Queued, **changed: Any) -> None:
        self._change([*self._tests[:index], test.model_copy(update=changed), *self._tests[index + 1 :]])

    def _change(self, tests: Sequence[Queued]) -> None:
        self._keep(tests)
        self._tests = tuple(tests)


def _refused(index: int, test: Queued, allowed: str) -> InvalidInput:
    return InvalidInput(f"test {index + 1}", str(test.stage), allowed)


def _another(folder: str | None, taken: set[str | None]) -> str | None:
    """A folder next to `folder` that no other test uses and that does not exist: `name-2`, `name-3`, ..."""
    if folder is None:
        return None
    number = 2
    while (name := f"{folder}-{number}") in taken or Path(name).exists():
        number += 1
    return name


@dataclass(frozen=True)
class Ready:
    """A test that was checked against the bench: its protocol, prepared with the parameters of the test."""

    protocol: "Protocol[Any]"
    prepared: "Prepared[Any]"


def queued(protocol: "Protocol[Any]", parameters: Parameters, out: Path | None, **how: object) -> Queued:
    """A pending test with these parameters; `how` holds other fields of `Queued`."""
    fields = {"protocol": protocol.name, "parameters": parameters.model_dump(mode="json"), **how}
    return Queued.model_validate({**fields, "out": None if out is None else str(out)})


def ready(test: Queued, number: int, configuration: "BenchConfiguration") -> Ready:
    """Check a test: its parameters against the bench, and its folder. Raises InvalidInput that names the test."""
    try:
        protocol = load_protocol(test.protocol)
        parameters = validated(protocol.parameters, test.parameters, dotted)
        prepared = protocol.prepare(parameters, configuration, None)
        if test.out is not None:
            check_folder(Path(test.out), result_names(protocol))
    except InvalidInput as refused:
        raise InvalidInput(f"test {number}: {refused.item}", refused.value, refused.allowed) from None
    return Ready(protocol, prepared)


def all_ready(tests: Sequence[Queued], configuration: "BenchConfiguration") -> Mapping[int, Ready]:
    """Check all pending tests; returns them by index. Raises InvalidInput for the first that cannot run, and for a
    folder used by two tests.
    """
    found: dict[int, Ready] = {}
    folders: dict[Path, int] = {}
    for index, test in enumerate(tests):
        if test.stage is not Stage.WAITING:
            continue
        found[index] = ready(test, index + 1, configuration)
        if test.out is not None and (first := folders.setdefault(Path(test.out).absolute(), index)) != index:
            allowed = f"test {first + 1} has the same folder; give each test a separate folder"
            raise InvalidInput(f"test {index + 1}: out", test.out, allowed)
    return found


def room_refusal(found: Iterable["DiskSpace | None"]) -> InvalidInput | None:
    """Error if the data files of all tests do not fit on the disk, which they are assumed to share; else None."""
    rooms = [room for room in found if room is not None]
    needed, free = sum(room.needed for room in rooms), min((room.free for room in rooms), default=0)
    if needed <= free:
        return None
    allowed = f"together the tests may need {needed / 1e9:.2f} GB, but {free / 1e9:.2f} GB are free; free disk space"
    return InvalidInput("queue", len(rooms), allowed)


def own_folder(test: Queued, moment: datetime, tests: Iterable[Queued] = ()) -> Path:
    """Folder for the results of a test that begins now: the specified folder, or a new one that none of the other
    `tests` uses. Raises InvalidInput if none can be created.
    """
    if test.out is not None:
        return Path(test.out)
    return make_folder(
        default_folder(test.protocol, moment), {Path(each.out) for each in tests if each.out is not None}
    )
