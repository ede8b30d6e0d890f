"""Check of the plans of a queue in the window: no test begins before all are accepted, individually and together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from PySide6.QtCore import QObject, Signal

from bench.app.gui.background import Reader
from bench.app.gui.controller import Controller
from bench.app.ipc.messages import PlanCheck, PlanChecked, Refused
from bench.app.preflight import DiskSpace
from bench.app.queue.queue import Queued, Ready, Stage, all_ready, room_refusal
from bench.config.model import BenchConfiguration


@dataclass(frozen=True, eq=False)
class Checked:
    """A test whose plan was accepted; `plan` is the request, with the configuration, and `found` the result."""

    test: Queued
    plan: PlanCheck
    found: PlanChecked

    @property
    def room(self) -> DiskSpace | None:
        if self.found.needed is None or self.found.free is None:
            return None
        return DiskSpace(self.plan.out, round(self.found.needed), round(self.found.free))


class QueueCheck(QObject):
    """Checks the parameters and folders of all pending tests in a thread, then their plans one by one, and finally the
    disk space for all of them. Tests are compared by identity, since copies may be equal.
    """

    good = Signal()
    """Emitted when all plans were accepted."""
    refused = Signal(object, str)
    """Emits the refused test, or None if the tests were refused together, and the reason."""
    changed = Signal()
    """Emitted when the check of the next test has begun."""

    def __init__(self, controller: Controller, parent: QObject) -> None:
        super().__init__(parent)
        self._controller = controller
        self._checked: list[Checked] = []
        self._tests: tuple[Queued, ...] = ()
        self._configuration = BenchConfiguration()
        self._left: list[tuple[Queued, Ready]] = []
        self._plan: PlanCheck | None = None
        self.test: Queued | None = None
        """The test that is being checked."""
        self._reader = Reader(self)
        self._reader.found.connect(self._read)
        controller.plan_checked.connect(self._plan_checked)

    def known(self, test: Queued, configuration: BenchConfiguration) -> Checked | None:
        """The accepted plan of this test for this configuration; None if there is none."""
        return next(
            (each for each in self._checked if each.test is test and each.plan.configuration is configuration), None
        )

    def begin(self, tests: Sequence[Queued], configuration: BenchConfiguration) -> None:
        """Check those pending tests of the queue `tests` that have not been checked yet; there must be at least one."""
        self._tests, self._configuration = tuple(tests), configuration
        self.test = next(test for test in self._waiting if self.known(test, configuration) is None)
        whole = self._tests
        self._reader.call(lambda: all_ready(whole, configuration))
        self.changed.emit()

    def cancel(self) -> None:
        """Cancel the check."""
        self.test, self._plan = None, None
        self._left.clear()
        self._controller.cancel_check(self)

    def forget(self) -> None:
        """Discard the results: the next start checks every plan again."""
        self._checked.clear()

    @property
    def _waiting(self) -> list[Queued]:
        return [test for test in self._tests if test.stage is Stage.WAITING]

    def _read(self, found: object) -> None:
        if self.test is None:
            return
        if not isinstance(found, Mapping):
            self.cancel()
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
            plan = PlanCheck(ready.protocol.name, ready.prepared.parameters, self._configuration, out)
            self._plan = plan
            self._controller.check_plan(plan, by=self)
            self.changed.emit()
            return
        self.cancel()
        found = [each for test in self._waiting if (each := self.known(test, self._configuration)) is not None]
        refused = room_refusal(each.room for each in found)
        if refused is not None:
            self.refused.emit(None, str(refused))
        else:
            self.good.emit()

    def _plan_checked(self, found: PlanChecked | Refused, by: object) -> None:
        test, plan = self.test, self._plan
        if by is not self or test is None or plan is None:
            return
        self._plan = None
        refusal = found.text if isinstance(found, Refused) else found.refusal
        if isinstance(found, PlanChecked) and refusal is None:
            self._checked.append(Checked(test, plan, found))
            self._next()
        else:
            self.cancel()
            self.refused.emit(test, str(refusal))
