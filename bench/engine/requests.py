"""What a person may ask of a running bench, from any thread or signal handler."""

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress

from drivers.errors import RigError
from sim.errors import UNKNOWN, Cause, CauseCode

_Made = tuple[str, Cause]


class Requests:
    """Three ways to end, each stronger than the one before; a request once made is never taken back.

    Plain flags: an assignment needs no lock that a signal handler could find taken.
    """

    def __init__(self) -> None:
        self._stop: _Made | None = None
        self._abort: _Made | None = None
        self._halt: _Made | None = None
        self._cut: Callable[[], None] | None = None
        self.interrupted = False
        """Whether a signal made one of them: then nothing is waited for once the rig is at rest."""
        self.breaking: Callable[[], BaseException] | None = None
        """What a signal handler raises in the main thread besides making its request; None: the loop looks itself."""
        self.rig_closed = False
        """Whether the session says that no rig is open; the process may be ended at once then."""

    @contextmanager
    def breakable(self, error: Callable[[], BaseException]) -> Generator[None]:
        """Within, a signal handler raises `error()`: for long computations, which look at no request."""
        before, self.breaking = self.breaking, error
        try:
            yield
        finally:
            self.breaking = before

    @contextmanager
    def without_rig(self) -> Generator[None]:
        """Within, no rig is open: an end that a signal asks for is KeyboardInterrupt."""
        self.rig_closed = True
        with self.breakable(KeyboardInterrupt):
            yield
        # after an error it stays so: the session ends without opening one
        self.rig_closed = False

    def cut_by(self, cut: Callable[[], None]) -> None:
        """From now on `halt` also calls `cut`, in the thread that asks."""
        self._cut = cut

    def stop(self, why: str = "stop was asked for", code: CauseCode = CauseCode.REQUEST) -> None:
        """Ramp the output out; what was measured is good. `why` is told as the reason, of the first that asked."""
        self._stop = self._stop or (why, Cause(code))

    def abort(self, why: str = "abort was asked for", code: CauseCode = CauseCode.REQUEST) -> None:
        """Ramp the output out fast; the run is bad."""
        self._abort = self._abort or (why, Cause(code))

    def halt(self, why: str = "halt was asked for", code: CauseCode = CauseCode.REQUEST) -> None:
        """Cut the enable line now, in this thread; the loop finds the rig halted and ends by itself."""
        self._halt = self._halt or (why, Cause(code))
        if self._cut is not None:
            # the loop cuts once more, and that is where a failure is told
            with suppress(RigError):
                self._cut()

    @property
    def strongest(self) -> str | None:
        """The strongest request made so far: "halt", "abort", "stop" or None."""
        if self._halt:
            return "halt"
        if self._abort:
            return "abort"
        return "stop" if self._stop else None

    @property
    def reason(self) -> str:
        """Why the strongest request was made; empty without any."""
        made = self._halt or self._abort or self._stop
        return made[0] if made else ""

    @property
    def cause(self) -> Cause:
        """Why it was made, for programs."""
        made = self._halt or self._abort or self._stop
        return made[1] if made else UNKNOWN
