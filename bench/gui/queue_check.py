"""Checks the plans of a queue at the window: none begins before all of them are good, alone and together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from PySide6.QtCore import QObject, Signal

from bench.cli.queueing import Ready, all_ready, room_refusal
from bench.config.model import BenchConfiguration
from bench.gui.background import Reader
from bench.gui.controller import Controller
from bench.link.messages import Refused, Survey, Surveyed
from bench.preflight.disk import Room
from bench.queue.queued import Queued, Stage


@dataclass(frozen=True, eq=False)
class Checked:
    """A test whose plan was found good on the bench of `plan`."""

    test: Queued
    plan: Survey
    found: Surveyed

    @property
    def room(self) -> Room | None:
        """What its record may need on the disk."""
        if self.found.needed is None or self.found.free is None:
            return None
        return Room(self.plan.out, round(self.found.needed), round(self.found.free))


class QueueCheck(QObject):
    """Parameters and folders of all tests that wait first, in a thread; then their plans, one survey after the other;
    then whether they fit on the disk together. Tests are told apart by identity: copies may be equal.
    """

    good = Signal()
    """All of them are."""
    refused = Signal(object, str)
    """The test whose plan is refused, or None for all of them together, and why."""
    changed = Signal()
    """Another test is being checked."""

    def __init__(self, controller: Controller, parent: QObject) -> None:
        super().__init__(parent)
        self._controller = controller
        self._checked: list[Checked] = []
        self._tests: tuple[Queued, ...] = ()
        self._configuration = BenchConfiguration()
        self._left: list[tuple[Queued, Ready]] = []
        self._asked: Survey | None = None
        self.test: Queued | None = None
        """The test that is being checked."""
        self._reader = Reader(self)
        self._reader.found.connect(self._read)
        controller.surveyed.connect(self._surveyed)

    def known(self, test: Queued, configuration: BenchConfiguration) -> Checked | None:
        """This test as it was checked for this bench, or None."""
        return next(
            (each for each in self._checked if each.test is test and each.plan.configuration is configuration), None
        )

    def begin(self, tests: Sequence[Queued], configuration: BenchConfiguration) -> None:
        """Check what waits of `tests`, the whole queue, and was not checked yet; there is at least one such test."""
        self._tests, self._configuration = tuple(tests), configuration
        self.test = next(test for test in self._waiting if self.known(test, configuration) is None)
        whole = self._tests
        self._reader.call(lambda: all_ready(whole, configuration))
        self.changed.emit()

    def give_up(self) -> None:
        """Check no more."""
        self.test, self._asked = None, None
        self._left.clear()
        self._controller.give_up(self)

    def forget(self) -> None:
        """What was checked is checked again the next time."""
        self._checked.clear()

    @property
    def _waiting(self) -> list[Queued]:
        return [test for test in self._tests if test.stage is Stage.WAITING]

    def _read(self, found: object) -> None:
        if self.test is None:
            return
        if not isinstance(found, Mapping):
            self.give_up()
            self.refused.emit(None, str(found))
            return
        every = cast(Mapping[int, Ready], found)
        self._left = [
            (test, every[index])
            for index, test in enumerate(self._tests)
            if index in every and self.known(test, self._configuration) is None
        ]
        self._next()

    def _next(self) -> None:
        if self._left:
            self.test, ready = self._left.pop(0)
            out = Path(self.test.out or "runs")
            plan = Survey(ready.protocol.name, ready.prepared.parameters, self._configuration, out)
            self._asked = plan
            self._controller.survey(plan, by=self)
            self.changed.emit()
            return
        self.give_up()
        found = [each for test in self._waiting if (each := self.known(test, self._configuration)) is not None]
        refused = room_refusal(each.room for each in found)
        if refused is not None:
            self.refused.emit(None, str(refused))
        else:
            self.good.emit()

    def _surveyed(self, found: Surveyed | Refused, by: object) -> None:
        test, asked = self.test, self._asked
        if by is not self or test is None or asked is None:
            return
        self._asked = None
        refusal = found.text if isinstance(found, Refused) else found.refusal
        if isinstance(found, Surveyed) and refusal is None:
            self._checked.append(Checked(test, asked, found))
            self._next()
        else:
            self.give_up()
            self.refused.emit(test, str(refusal))
