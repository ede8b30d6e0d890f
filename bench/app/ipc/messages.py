"""Messages between a session and its clients, pickled over connections that only this user's processes can open."""

import json
import pickle
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import Further
from bench.config.model import BenchConfiguration
from bench.datafile.tables import Column, Table
from bench.events import Event, State
from bench.preflight.margins import Margin
from bench.results import SUMMARY
from sim.errors import UNKNOWN, Cause
from sim.parameters import Parameters

BEAT = 0.25
"""Longest interval between messages from either side [s]."""
SILENCE = 1.0
"""Silence of the session process after which the client shows "no link" [s]."""
PATIENCE = 3.0
"""Silence of the client after which the session considers it lost [s]."""
VIRTUAL_PATIENCE = 60.0
"""The same for a run in virtual time [s], which waits for its client after a silence of `SILENCE`. On a loaded computer
the window's thread may receive no processor time for several seconds.
"""


@dataclass(frozen=True)
class PlanCheck:
    """Request to compute the complete run in advance, without opening a device. `protocol` is the name of an installed
    protocol.
    """

    protocol: str
    parameters: Parameters
    configuration: BenchConfiguration
    out: Path


@dataclass(frozen=True)
class Run(PlanCheck):
    """Request to run a protocol; its results are written to `out`.

    realtime : whether a simulated bench runs in real time.
    person : whether the client answers the questions. Otherwise a bench that needs no operator performs the operator
        tasks, and on any other bench every question is answered with yes.
    keep_going : whether the run continues if the client is lost.
    about : notes that are stored in the data file.
    """

    realtime: bool = False
    person: bool = False
    keep_going: bool = False
    about: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def paced(self) -> bool:
        """Whether the bench runs in real time; otherwise its time stands still while the session computes or waits."""
        return self.realtime or self.configuration.real_time_only


@dataclass(frozen=True)
class Ask:
    """Request of the client to end the run: "stop", "abort" or "halt"."""

    end: str


@dataclass(frozen=True)
class Answer:
    """Answer to question `number`; ignored unless that question is pending."""

    number: int
    agreed: bool


@dataclass(frozen=True)
class Note:
    """A note for the log and the data file; `by` is the operator's name."""

    text: str
    by: str


@dataclass(frozen=True)
class Alive:
    """The client's main loop is running."""


@dataclass(frozen=True)
class ReadOnly:
    """The client only displays the run: it answers no question, and its requests are ignored."""


@dataclass(frozen=True)
class Leave:
    """The client disconnects in an orderly way."""


@dataclass(frozen=True)
class PlanChecked:
    """Result of a plan check.

    refusal : reason for the refusal of the plan; None if it is accepted.
    duration : expected duration [s]; None if not predicted.
    needed, free : disk space for the data file, and free disk space [B]; None if the duration is unknown.
    """

    margins: tuple[Margin, ...]
    refusal: str | None
    warnings: tuple[str, ...]
    duration: float | None
    needed: float | None
    free: float | None
    plan_hash: str
    prediction: Table


@dataclass(frozen=True)
class Attached:
    """First message to a client that attaches to a session.

    operator : name of the operator; may be empty.
    owner : "window" or "terminal".
    elapsed : time since the run was started [s].
    """

    run: Run
    operator: str
    owner: str
    elapsed: float


@dataclass(frozen=True)
class Control:
    """Whether an attached client may answer questions and request the ramp-out, because the owner's window is lost.
    Every client that is not read-only may abort or halt the run.
    """

    granted: bool


@dataclass(frozen=True)
class Opened:
    """The rig is open.

    channels : names of its channels.
    sample_rate : sample rate [1/s].
    devices : description of its devices.
    further : signals that follow those of `bench.app.ipc.messages.TRACES` in every block of traces.
    duration : expected duration of the run [s]; None if not predicted.
    prediction, margins : prediction and margins of the plan.
    """

    channels: tuple[str, ...]
    sample_rate: float
    devices: Mapping[str, str]
    further: tuple[Further, ...] = ()
    duration: float | None = None
    prediction: Table = field(default_factory=dict[str, Column])
    margins: tuple[Margin, ...] = ()


@dataclass(frozen=True)
class Preparing:
    """A stage before the rig is opened or after it is closed; `done` of its `total` parts are complete; both are 0 if
    the parts cannot be counted.
    """

    phase: str
    done: int = 0
    total: int = 0


@dataclass(frozen=True)
class Published:
    """An event of the engine other than a block of samples."""

    event: Event


@dataclass(frozen=True)
class Question:
    """A question to the operator. The plan waits for the answer, which must contain the same `number`."""

    number: int
    request: str


@dataclass(frozen=True)
class SafetyInputs:
    """The safety inputs by name, each True if good at bench time `time` [s]; empty if there are none."""

    time: float
    good: Mapping[str, bool]


@dataclass(frozen=True, eq=False)
class Traces:
    """Signals of one block: those of `bench.app.ipc.messages.TRACES`, then the further ones of the rig.

    begin, step : bench time at the start of the first bin, and length of a bin [s].
    low, high : minimum and maximum of each signal in each bin, shape (n_bins, n_signals).
    read : time on the computer's clock (`drivers.clock.now`) at which the block had been read [s].
    origin : bench time of the run's first sample [s].
    magnitudes : those of `bench.events.Acquired`.
    """

    run: int
    begin: float
    step: float
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    read: float
    origin: float = 0.0
    magnitudes: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class Beat:
    """Heartbeat of the session process.

    state, reason : state of the engine, and reason for its last change.
    time : bench time [s].
    lost_events, lost_traces : numbers of events and of blocks of traces lost because the client did not read them.
    quiet : time since the engine's last event [s]; while the rig is armed, every block of samples is an event.
    """

    state: State
    reason: str
    time: float
    lost_events: int
    lost_traces: int
    quiet: float = 0.0


@dataclass(frozen=True)
class Ended:
    """The run has ended and its files are written.

    summary : contents of the summary file, which can be converted to JSON.
    table : the results as text for the terminal.
    passed : verdict of a protocol that tests the bench; True for any other protocol.
    cause : cause of the end; unknown if only the files report the end.
    """

    status: str
    reason: str
    summary: dict[str, object]
    table: str
    out: Path
    passed: bool = True
    cause: Cause = UNKNOWN


@dataclass(frozen=True)
class Refused:
    """The request was refused or, if `failed`, the session failed.

    text : error message.
    cause : cause, if known.
    details : information for developers; may be long.
    """

    text: str
    cause: Cause = UNKNOWN
    failed: bool = False
    details: str = ""


FromSession = (
    Attached
    | Control
    | PlanChecked
    | Preparing
    | Opened
    | Published
    | Question
    | SafetyInputs
    | Traces
    | Beat
    | Ended
    | Refused
)
FromClient = Ask | Answer | Note | Alive | ReadOnly | Leave


def receive(connection: Connection) -> object | None:
    """The next message; None for a message that this version of the program cannot read, so that a session of another
    version can still be stopped. Raises EOFError or OSError at the end of the connection.
    """
    data = connection.recv_bytes()
    try:
        return pickle.loads(data)
    except Exception:
        return None


TRACES = ("drive", "acceleration", "displacement", "u1", "u2", "drift")
"""Columns of traces: drive [V], table acceleration [m/s2] and displacement [m], displacements of the storeys
relative to the table [m] and the drift, their difference [m]. Further channels follow, as in `bench.analysis.signals`.
"""

BIN = 0.002
"""Length of a bin [s] before rounding to whole samples."""


def extremes(values: NDArray[np.float64], width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Minimum and maximum of every `width` rows of `values`, shape (n, m); the last bin contains the remainder. A bin
    is NaN only if all its values are NaN.
    """
    return extremes_from(values, np.arange(0, len(values), width))


def extremes_from(
    values: NDArray[np.float64], starts: NDArray[np.intp]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Minimum and maximum of the bins that begin at the rows `starts` of `values`, as `extremes` does."""
    low = np.fmin.reduceat(values, starts, axis=0)
    high = np.fmax.reduceat(values, starts, axis=0)
    return low.astype(np.float32), high.astype(np.float32)


def ended_by_files(out: Path) -> Ended | None:
    """The end of the run in the folder `out` as stated in its summary file; None without a readable file."""
    with suppress(OSError, ValueError, KeyError):
        content = json.loads((out / SUMMARY).read_text(encoding="utf-8"))
        passed = content.get("passed", True) is not False
        return Ended(content["status"], content["reason"], content, "", out, passed)
    return None
