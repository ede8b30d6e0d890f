"""State of a session as its clients display it: bench, safety inputs, connection and end of the run."""

from collections.abc import Mapping
from math import inf
from typing import Literal

from bench.app.display import texts
from bench.app.display.status import DRIVEN, Level, Status, bench_status
from bench.app.ipc.messages import (
    SILENCE,
    Attached,
    Beat,
    Control,
    Ended,
    FromSession,
    Opened,
    Preparing,
    Published,
    Question,
    Refused,
    Run,
    SafetyInputs,
)
from bench.app.ipc.sessions import RunningSession
from bench.app.run_display import Notice, RunDisplay
from bench.events import State, StateChanged
from drivers.clock import now

STALE = 2.0
"""Age of the last reading [s] above which the safety inputs are shown as unknown."""
Link = Literal["starting", "linked", "no link", "over"]
"""State of a connection, as in `bench.app.ipc.client`."""


class SessionState:
    """State of one session, updated from its messages; without a session, the state before the first run.

    attached : session of another client that is displayed; None for a session that this client has started.
    """

    def __init__(self, attached: RunningSession | None = None) -> None:
        self.scene = RunDisplay()
        self.attached = attached
        self.run: Run | None = None
        """The run; None before one has begun, and until an attached session has sent its description."""
        self.inputs: Mapping[str, bool] = {}
        self._inputs_received: float | None = None
        self.driven = False
        """Whether the rig has been armed in the run."""
        self.question: Question | None = None
        """The unanswered question, if any."""
        self.controls = attached is None
        """Whether this client may answer questions and ramp out. STOP is always effective."""
        self.lost = (0, 0)
        """Numbers of events and of blocks of traces that this client did not receive."""
        self.ended: Ended | Refused | None = None
        self._quiet, self._longest_quiet = 0.0, inf
        self._failure = ""
        self._started = self._stopped_at = 0.0

    def begin(self, run: Run, elapsed: float = 0.0) -> None:
        """Set the run, which was started `elapsed` seconds ago."""
        # a simulated bench that does not run in real time may be silent while the model computes
        self._longest_quiet = SILENCE + run.configuration.acquisition.block_duration if run.paced else inf
        self.run, self._started = run, now() - elapsed

    @property
    def inputs_age(self) -> float | None:
        """Time since the last message on the safety inputs [s]; None before the first."""
        return None if self._inputs_received is None else now() - self._inputs_received

    def inputs_line(self, *, running: bool) -> tuple[str, Level]:
        """Text of the safety inputs and its level (colour); readings older than `STALE` are shown as unknown."""
        age, wired = self.inputs_age, self.inputs
        if not running:
            return texts.INPUTS_UNREAD, "calm"
        if age is not None and not wired:
            return texts.NO_INPUTS, "calm"
        if age is not None and age <= STALE:
            words = (texts.INPUT_OPEN, texts.INPUT_GOOD)
            text = ", ".join(f"{name} {words[good]}" for name, good in wired.items())
            return text, "calm" if all(wired.values()) else "alarm"
        return ", ".join(f"{name} {texts.INPUT_UNKNOWN}" for name in wired) or texts.INPUT_UNKNOWN, "wait"

    @property
    def elapsed(self) -> float:
        """Wall-clock time since the run was started, up to its end [s]."""
        return (self._stopped_at or now()) - self._started if self._started else 0.0

    @property
    def since_end(self) -> float:
        """Time since the end of the run [s]; 0 before the end."""
        return now() - self._stopped_at if self._stopped_at else 0.0

    @property
    def failed(self) -> bool:
        """Whether the session has failed."""
        return bool(self._failure)

    def status(self, link: Link | None, silence: float = 0.0, *, lives: bool = False) -> Status:
        """Status to be displayed for the state of the connection `link` (None without one), `silence` seconds after the
        last message; `lives` is whether the session can still send messages.
        """
        scene = self.scene
        if self._failure:
            return Status(texts.FAILED_WORD, self._failure, "alarm", "cross")
        if link is None:
            return bench_status("over" if self._started else "none", scene.state, scene.reason, 0.0)
        if link == "starting" and self.attached is not None:
            return Status(texts.ATTACHING, texts.ATTACHING_WHY.format(run=self.attached.title), "wait", "ring")
        if link == "linked" and scene.state in DRIVEN and self._quiet > self._longest_quiet:
            # the process runs but its engine does not respond: the last known state may be outdated
            return bench_status("no link", scene.state, scene.reason, self._quiet)
        planning = scene.preparing and scene.state is State.IDLE
        if planning and (link == "linked" or (link == "no link" and lives)):
            # the rig is not open yet; while the plan is computed, a busy computer may delay the messages
            late = "" if link == "linked" else f" ({texts.PLANNING_LATE.format(age=silence)})"
            return Status(texts.PLANNING, f"{scene.reason}{late}", "wait", "ring")
        # the reason for the change of state no longer applies once the plan continues
        reason = scene.step if scene.state is State.RUNNING and scene.step else scene.reason
        return bench_status(link, scene.state, reason, silence)

    def follow(self, message: FromSession) -> Notice | None:
        """Update the state with a message other than traces; returns its log line, if any."""
        scene = self.scene
        match message:
            case Published(event):
                if isinstance(event, StateChanged):
                    self.driven = self.driven or event.after in DRIVEN
                    if event.after is not State.WAITING:
                        self.question = None
                return scene.update(event)
            case Beat():
                # the heartbeat gives the correct state even if the event with the change of state was lost
                scene.state, scene.time = message.state, message.time
                if not scene.preparing:
                    scene.reason = message.reason
                self.driven = self.driven or message.state in DRIVEN
                self.lost, self._quiet = (message.lost_events, message.lost_traces), message.quiet
            case Preparing():
                scene.prepare(message.phase, message.done, message.total)
            case Attached():
                self.begin(message.run, message.elapsed)
            case Control():
                self.controls = message.granted
            case Opened():
                scene.expect(message.duration)
            case Question():
                self.question = message
            case SafetyInputs():
                self.inputs, self._inputs_received = message.good, now()
            case Ended() | Refused():
                return self._end(message)
            case _:
                pass
        return None

    def _end(self, message: Ended | Refused) -> Notice:
        self.ended, self.question, self._stopped_at = message, None, now()
        if isinstance(message, Ended):
            self.scene.preparing, self.scene.reason = False, message.reason
            return Notice(self.scene.time, "end", f"{message.status}: {message.reason}")
        self.scene.state, self.scene.reason = State.CLOSED, message.text
        self._failure = texts.FAILED.format(text=message.text) if message.failed else ""
        return Notice(self.scene.time, "end", message.text, grave=True)
