"""What passes between the process of a session and its client. Everything is pickled between two processes of one
program, over a connection that only its own child can open.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import Further
from bench.config.model import BenchConfiguration
from bench.events import Event, State
from bench.preflight.margins import Margin
from bench.record.tables import Table
from sim.errors import UNKNOWN, Cause
from sim.parameters import Parameters

BEAT = 0.25
"""Each side says at least this often that it is there [s]."""
SILENCE = 1.0
"""After so long without a word from the session's process its client shows no link [s]."""
PATIENCE = 3.0
"""After so long without a word the session takes its client for lost [s]."""


@dataclass(frozen=True)
class Survey:
    """The whole run computed beforehand; opens nothing. `protocol` is the name of one that is installed."""

    protocol: str
    parameters: Parameters
    configuration: BenchConfiguration
    out: Path


@dataclass(frozen=True)
class Run(Survey):
    """The run itself; its results go to `out`.

    `person` says that the client answers the questions; else a bench that serves itself does the hand work, and on any
    other one every question is answered with yes. With `keep_going` a lost client does not end the run. `about` is kept
    in the data file.
    """

    realtime: bool = False
    person: bool = False
    keep_going: bool = False
    about: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class Ask:
    """The client asks for an end: "stop", "abort" or "halt"."""

    end: str


@dataclass(frozen=True)
class Answer:
    """The answer to question `number`; an answer to another question than the one that stands is void."""

    number: int
    agreed: bool


@dataclass(frozen=True)
class Alive:
    """The client's main loop turns."""


@dataclass(frozen=True)
class Leave:
    """The client goes, in order."""


@dataclass(frozen=True)
class Surveyed:
    """What the survey found: `refusal` says why the run would be refused; sizes in bytes, `duration` in seconds."""

    margins: tuple[Margin, ...]
    refusal: str | None
    warnings: tuple[str, ...]
    duration: float | None
    needed: float | None
    free: float | None
    plan_hash: str
    prediction: Table


@dataclass(frozen=True)
class Opened:
    """The rig is open: the names of its channels, samples per second, and what is known of its devices.

    `further` are the signals that come after those of `bench.link.reduction.TRACES` in every block of traces.
    """

    channels: tuple[str, ...]
    sample_rate: float
    devices: Mapping[str, str]
    further: tuple[Further, ...] = ()


@dataclass(frozen=True)
class Told:
    """An event of the engine that is no block of samples."""

    event: Event


@dataclass(frozen=True)
class Question:
    """The plan waits for a person: `number` belongs in the answer."""

    number: int
    request: str


@dataclass(frozen=True)
class SafetyInputs:
    """The safety inputs by name, and whether each was good at bench time `time` [s]; empty where there are none."""

    time: float
    good: Mapping[str, bool]


@dataclass(frozen=True, eq=False)
class Traces:
    """Signals of one block: `low` and `high` have shape (n_bins, n_signals), extremes in bins of `step` seconds.

    The first bin begins at bench time `begin` [s]; the signals are `bench.link.reduction.TRACES`. `read` is the second
    of the machine's clock (`drivers.clock.now`) at which the block had been read, `origin` the bench time of the run's
    first sample [s].
    """

    run: int
    begin: float
    step: float
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    read: float
    origin: float = 0.0


@dataclass(frozen=True)
class Beat:
    """The session's process lives: the engine's state, bench time [s], what did not pass so far for want of a reader
    (events, and blocks of traces), and for how many seconds the engine has said nothing: while the rig is armed it
    tells of every block.
    """

    state: State
    reason: str
    time: float
    lost_events: int
    lost_traces: int
    quiet: float = 0.0


@dataclass(frozen=True)
class Ended:
    """The run is over, its files are written; `summary` is ready for JSON, `table` is plain text.

    `passed` is the verdict of a protocol that judges the bench, True of any other.
    The cause of a run that is known by its files alone is unknown.
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
    """Nothing was started, or something failed (`failed`): `text` says what, `cause` why, where it is known.

    `details` are for whoever looks after the program, and may be long.
    """

    text: str
    cause: Cause = UNKNOWN
    failed: bool = False
    details: str = ""


FromSession = Surveyed | Opened | Told | Question | SafetyInputs | Traces | Beat | Ended | Refused
FromClient = Ask | Answer | Alive | Leave
