"""Runs a queue in the window: all plans are checked first, then the tests run in separate sessions. STOP, or a test
that is stopped, fails or does not pass, pauses the queue.
"""

from collections.abc import Callable
from datetime import datetime

from PySide6.QtCore import QObject, QTimer, Signal

from bench.app.display import texts
from bench.app.display.trouble import Trouble
from bench.app.folders import remove_unused
from bench.app.gui.controller import Controller
from bench.app.gui.queue_check import Checked, QueueCheck
from bench.app.ipc.messages import Ended, Refused, Run
from bench.app.queue.file import Owner, QueueFile
from bench.app.queue.queue import Queue, Queued, Stage, own_folder
from bench.config.model import BenchConfiguration
from sim.errors import RockbenchError

GOOD = ("completed", "stopped")


class QueueRunner(QObject):
    """The queue and its running test. The `store` is locked until `close`; without a store the queue is not saved.
    Raises InvalidInput for a store that cannot be read, or that another program has locked.
    """

    changed = Signal()
    """Emitted when a test has changed, or the queue was started or paused."""
    troubled = Signal(object)
    """Emits a `Trouble` when the queue could not be saved or a change was refused."""
    predicted = Signal(object)
    """Emits the prediction of the test that is about to begin."""

    def __init__(
        self,
        controller: Controller,
        configuration: BenchConfiguration,
        store: QueueFile | None = None,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._controller = controller
        self.configuration = configuration
        self.path = None if store is None else store.path
        self._owner = None if store is None else Owner(store.path, texts.QUEUE_OWNER)
        self.going = False
        """Whether the queue continues with the next test when the current one ends."""
        self.why = ""
        """Reason for the pause of the queue; empty unless a problem caused it."""
        try:
            self.queue = Queue() if store is None else Queue(store.read(), store.write)
        except RockbenchError:
            self.close()
            raise
        self._begun: tuple[Run, Checked] | None = None
        self._check = QueueCheck(controller, self)
        self._check.good.connect(self._next)
        self._check.refused.connect(self._refused)
        self._check.changed.connect(self.changed)
        controller.began.connect(self._began)
        controller.ended.connect(self._ended)
        controller.changed.connect(self._pause_if_stopped)

    @property
    def why_not(self) -> str:
        """Reason why the queue cannot be started now; empty if it can."""
        if self._controller.latched:
            return texts.LATCHED
        if self.queue.running is None and (busy := self._controller.why_busy):
            return busy
        return "" if self.queue.next is not None else texts.QUEUE_EMPTY

    @property
    def checking(self) -> int | None:
        """Index of the test whose plan is being checked; None if there is none."""
        return None if self._check.test is None else self._place(self._check.test)

    def close(self) -> None:
        """Start no further test, and release the file."""
        self.going = False
        if self._owner is not None:
            self._owner.release()

    def do(self, change: Callable[[], object]) -> bool:
        """Apply `change` to the queue, and return whether it succeeded. A refusal, or a failure to save the queue, is
        reported and pauses the queue.
        """
        try:
            change()
        except RockbenchError as error:
            self.pause()
            self.troubled.emit(Trouble(str(error), texts.QUEUE_DID, texts.QUEUE_NOW))
            return False
        finally:
            self.changed.emit()
        return True

    def replace(self, old: Queued, new: Queued) -> bool:
        """Replace the test `old` in place, and return whether this succeeded. A refusal is reported if `old` has begun,
        or was changed, skipped or removed.
        """
        index = self._place(old)
        if index is None:
            self.troubled.emit(Trouble(texts.QUEUE_GONE, texts.QUEUE_GONE_DID, texts.QUEUE_GONE_NOW))
            return False
        return self.do(lambda: self.queue.replace(index, new))

    def start(self) -> None:
        """Check every pending plan, then begin the first."""
        if not self.going and not self.why_not:
            self.going, self.why = True, ""
            self._check.forget()
            self._controller.held = texts.QUEUE_HOLDS
            if self.queue.running is None:
                self._next()
            self.changed.emit()

    def pause(self, why: str = "") -> None:
        """Start no further test. The current test continues; plan checks are cancelled."""
        self._check.cancel()
        self.going, self.why = False, why or self.why
        self._controller.held = ""
        self.changed.emit()
        self._controller.changed.emit()

    def _pause_if_stopped(self) -> None:
        if self.going and self._controller.latched:
            self.pause(texts.QUEUE_STOPPED)
        elif self.why == texts.QUEUE_STOPPED and not self._controller.latched:
            self.why = ""
            self.changed.emit()

    def _place(self, test: Queued) -> int | None:
        """Index of a test by identity, since a copy may be equal to it."""
        return next((i for i, each in enumerate(self.queue.tests) if each is test), None)

    def _next(self) -> None:
        index = self.queue.next
        if not self.going or self._controller.running or index is None:
            self.pause()
            return
        tests, configuration = self.queue.tests, self.configuration
        known = [self._check.known(test, configuration) for test in tests if test.stage is Stage.WAITING]
        first = known[0]
        if first is None or None in known:
            self._check.begin(tests, configuration)
        else:
            self._begin(index, first)

    def _refused(self, test: Queued | None, why: str) -> None:
        index = None if test is None else self._place(test)
        if index is None:
            self.pause(f"{why}.")
        else:
            self._finish_test(
                index, good=False, outcome=f"refused: {why}", why=texts.QUEUE_REFUSED.format(number=index + 1)
            )

    def _begin(self, index: int, each: Checked) -> None:
        test, plan = each.test, each.plan
        try:
            out = own_folder(test, datetime.now(), self.queue.tests)
        except RockbenchError as error:
            self._refused(test, str(error))
            return
        if not self.do(lambda: self.queue.begin(index, str(out))):
            if test.out is None:
                remove_unused(out)
            return
        self.predicted.emit(each.found.prediction)
        run = Run(
            plan.protocol,
            plan.parameters,
            plan.configuration,
            out,
            realtime=test.realtime,
            person=(test.ask or not plan.configuration.serves_itself) and not test.unattended,
            keep_going=test.keep_going,
            about=test.about,
        )
        self._begun = run, each
        self._controller.start(run)
        self.changed.emit()

    def _began(self, run: Run) -> None:
        if self._begun is not None and run is not self._begun[0]:
            self._begun = None

    def _ended(self, ended: Ended | Refused) -> None:
        index, begun = self.queue.running, self._begun
        if index is None or begun is None:
            return
        self._begun = None
        if begun[1].test.out is None:
            remove_unused(begun[0].out)
        if isinstance(ended, Refused):
            status, good, outcome = ("failed" if ended.failed else "refused"), False, ended.text
            stated = status
        else:
            status, good = ended.status, ended.passed and ended.status in GOOD
            not_passed = ended.status == "completed" and not ended.passed
            outcome, stated = ("not passed", "not passed") if not_passed else (ended.reason, status)
        why = "" if stated == "completed" and good else texts.QUEUE_ENDED.format(number=index + 1, status=stated)
        self._finish_test(index, good=good, outcome=f"{status}: {outcome}", why=why)

    def _finish_test(self, index: int, *, good: bool, outcome: str, why: str) -> None:
        kept = self.do(lambda: self.queue.finish(index, good=good, outcome=outcome))
        if why or not kept:
            self.pause(self.why if self._controller.latched else why)
        elif self.going:
            # all slots of `ended` must run before the next test begins
            QTimer.singleShot(0, self._next)
