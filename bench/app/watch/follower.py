"""Read-only client that follows the sessions on this computer, one after another."""

from collections import deque
from dataclasses import replace
from datetime import datetime
from math import nan

from bench.analysis.signals import Further
from bench.app.display import texts
from bench.app.display.buffers import BlockAngle, Ring
from bench.app.display.campaign import Campaign
from bench.app.display.figure import live_view
from bench.app.display.gains import Line, Mark, kind_of, lines_of, mark_of
from bench.app.display.meters import Meter, meters_of
from bench.app.display.run_contents import RunContents
from bench.app.display.session_state import SessionState
from bench.app.display.status import Status
from bench.app.display.traces import STALE
from bench.app.display.trouble import Trouble, trouble_of
from bench.app.ipc.client import AttachedClient
from bench.app.ipc.messages import TRACES, Attached, Ended, FromSession, Opened, Published, Refused, Traces
from bench.app.ipc.sessions import RunningSession, running_sessions
from bench.app.run_display import Notice
from bench.events import PointFinished, State, StepStarted
from bench.live_values import Estimate, RunningGain, TwinEstimate
from bench.live_view import LiveRun, Panel
from drivers.clock import now

SEARCH = 0.5
"""Interval between searches for a session [s]."""
LOG_LINES = 100
"""Maximum number of log lines kept."""


class RunRecord:
    """Contents of the page for one run, from the messages received so far; empty before the first run."""

    def __init__(self, session: RunningSession | None = None) -> None:
        self.state = SessionState(session)
        self.contents = RunContents()
        self.live: LiveRun | None = None
        self.meters: list[Meter] = []
        self.campaign: Campaign | None = None
        self.further: tuple[Further, ...] = ()
        self.ring, self.block = Ring(len(TRACES)), BlockAngle()
        self.blocks = 0
        """Number of blocks of traces received."""
        self.lines: list[Line] = []
        self.kind = kind_of({})
        self.marks: list[Mark] = []
        self.running: tuple[float, float] | None = None
        """Abscissa (circular frequency [rad/s], or stiffness ratio) and value of the running gain."""
        self.log = deque[Notice](maxlen=LOG_LINES)
        self.trouble: Trouble | None = None
        self._read, self._length = nan, 0.0

    @property
    def age(self) -> float:
        """Time since the newest block was read [s]; NaN without blocks."""
        return max(now() - self._read, 0.0)

    @property
    def over(self) -> bool:
        """Whether the motion of the run has ended, even if its files are not yet closed."""
        return self.state.ended is not None or self.state.scene.state in (State.CLOSED, State.HALTED)

    @property
    def stale(self) -> bool:
        """Whether traces, meters and picture are out of date."""
        return not self.age < STALE or self.over

    @property
    def moment(self) -> float:
        """Bench time [s] of the picture, at which table, frame and block are known."""
        return self.block.nearest(self.ring.newest - max(self._length - self.age, 0.0))

    @property
    def panel(self) -> Panel | None:
        """The first panel of the live view with measured lines; None if there is none or the protocol has gains."""
        protocol = self.contents.protocol
        if protocol is None or self.live is None or self.contents.has_gain:
            return None
        panels = (part for part in live_view(protocol, self.live) if isinstance(part, Panel))
        return next((panel for panel in panels if any(curve.style == "line" for curve in panel.curves)), None)

    def follow(self, message: FromSession) -> None:
        """Update the record with a message."""
        if isinstance(message, Traces):
            self._trace(message)
            return
        notice = self.state.follow(message)
        if notice is not None:
            self.log.append(notice)
        match message:
            case Attached():
                run = message.run
                self.contents, self.meters = RunContents(run), meters_of(run.configuration)
                if (protocol := self.contents.protocol) is not None:
                    self.campaign = Campaign(protocol, run)
                    self.live = LiveRun(protocol.point, run.parameters, run.configuration)
            case Opened():
                self._open(message)
            case Published(event):
                face = self.contents.arrangement.face
                self.contents.follow(event)
                if face != self.contents.arrangement.face:
                    # earlier samples of laser 2 were measured on another target
                    self.ring.discard_before(self.contents.arranged)
                if self.campaign is not None:
                    self.campaign.follow(event)
                if self.live is not None:
                    self.live.follow(event)
                match event:
                    case TwinEstimate():
                        self.block.add(event)
                    case Estimate() | RunningGain():
                        x = event.omega if isinstance(event, Estimate) else event.beta
                        self.running = None if x is None or not event.alpha_2 > 0.0 else (x, event.alpha_2)
                    case PointFinished():
                        mark, self.running = mark_of(event.point.model_dump()), None
                        self.marks += [] if mark is None else [mark]
                    case StepStarted():
                        self.running = None
                    case _:
                        pass
            case Ended() | Refused():
                self.trouble, self.running = trouble_of(message, driven=self.state.driven), None
                self.contents.end_step()
                if self.campaign is not None:
                    self.campaign.end()
            case _:
                pass

    def expected(self, place: tuple[int, int]) -> datetime | None:
        """Estimated end of the point at `place`; None if it is unknown, or if the point is complete."""
        if self.campaign is None or self.over:
            return None
        return self.campaign.expected(place, self.state.scene.time_left, datetime.now())

    def _open(self, opened: Opened) -> None:
        self.further = opened.further
        self.ring = Ring(len(TRACES) + len(opened.further))
        self.lines, self.kind = lines_of(opened.prediction), kind_of(opened.prediction)
        if self.campaign is not None:
            self.campaign.name_points(opened.prediction)
        if self.live is not None:
            self.live.prediction = opened.prediction
        if self.state.run is not None:
            self.meters = meters_of(self.state.run.configuration, opened.margins)

    def _trace(self, block: Traces) -> None:
        self.ring.add(block)
        self.block.place(block)
        self._read, self._length = block.read, block.step * len(block.low)
        self.blocks += 1
        for meter in self.meters:
            if meter.key in block.magnitudes:
                meter.add(block.begin, block.magnitudes[meter.key])


class SessionFollower:
    """Follower of the session under way, preferably that of a real bench, until it ends. The record of an ended run is
    kept until the next session begins.

    process : identifier of the only process whose session is followed; None for any.
    """

    def __init__(self, process: int | None = None) -> None:
        self._process = process
        self._client: AttachedClient | None = None
        self._searched = -SEARCH
        self._found: list[RunningSession] = []
        self._ended: RunningSession | None = None
        self.record = RunRecord()

    @property
    def status(self) -> Status:
        """Status of the bench for the page, with or without a session."""
        client = self._client
        if client is not None:
            return self.record.state.status(client.status, client.silence, lives=client.lives)
        status = self.record.state.status(None)
        return replace(status, reason=texts.NO_RUN_HERE) if status.word == texts.NO_SESSION else status

    @property
    def attached(self) -> bool:
        """Whether a session is followed at present."""
        return self._client is not None

    @property
    def others(self) -> int:
        """Number of sessions under way, excluding the followed one."""
        return max(len(self._found) - self.attached, 0)

    def update(self) -> None:
        """Handle all messages, and attach to a session if none is followed."""
        if now() - self._searched >= SEARCH:
            self._searched = now()
            found = running_sessions()
            self._found = [each for each in found if self._process in (None, each.process) and each != self._ended]
            if self._client is None and self._found:
                self.record = RunRecord(self._found[0])
                self._client = AttachedClient(self._found[0], read_only=True)
        if self._client is not None:
            for message in self._client.take():
                self.record.follow(message)
            if self.record.state.ended is not None:
                # the session is still announced until its files are closed
                self._ended = self.record.state.attached
                self.close()

    def close(self) -> None:
        """Detach from the session, which continues unaffected."""
        client, self._client = self._client, None
        if client is not None:
            client.leave()
