"""What must be true of every run, whatever went wrong in it."""

import shutil
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.datafile import recorder as recording
from bench.datafile.reader import DataFile, open_datafile
from bench.engine.interface import SEVERITY
from bench.engine.output import TRANSITIONS
from bench.events import LimitExceeded, State, StateChanged
from bench.guard.limits import Limits
from sim.virtual_bench import VirtualBench
from tests.faults.bench import FaultyBench, Story, released, run
from tests.faults.fault import Fault
from tests.faults.places import Place
from tests.faults.rig import Run
from tests.faults.setup import LIMITS, RATE
from tests.patience import LONG

STILL = 2e-4
"""Velocity [m/s] and displacement [m] below which the bench stands still."""
REST = 30
"""Seconds that it may take to come to rest; a block that was made to rock takes the most."""
BASE = {None: "completed", "stop": "stopped", "abort": "aborted", "halt": "halted"}
"""How the run ends without a fault, by what is asked for."""
RAMPED = ("completed", "stopped", "aborted")
"""Endings in which the enable line is never cut."""
SMALL_BACKLOG, SHORT_PATIENCE = 8, 0.05


@dataclass(frozen=True)
class Verdict:
    """What a fault at a place came to, by their names: whether it struck at all, whether it should have, how the run
    ended, whether it was noticed, and every rule that was broken."""

    fault: str
    place: str
    fired: bool
    lost: bool
    noticed: bool
    status: str
    reason: str
    broken: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.fault} at {self.place!r}: {'; '.join(self.broken)} [{self.status}: {self.reason}]"


def judge(fault: Fault, place: Place, folder: Path, *, recorded: bool = True) -> Verdict:
    """Put `fault` into a campaign at `place`, and hold what came of it against the rules; `folder` is left empty.

    Without a record the rules of the run remain, a quarter of the time; a fault of the disk always has one.
    """
    if not (recorded or fault.disk):
        return _judged(fault, place, None)
    with TemporaryDirectory(dir=folder) as own:
        return _judged(fault, place, Path(own) / "campaign.h5")


def _judged(fault: Fault, place: Place, path: Path | None) -> Verdict:
    before = set(threading.enumerate())
    with disk_of(fault):
        bench = FaultyBench(path, place, fault.begin)
        with released(bench):
            story = run(bench)
            noticed = was_noticed(story, fault)
            broken = [*ending_rules(story, fault, place, noticed), *output_rules(story, fault)]
            if path is not None and fault.disk == "hung" and noticed:
                with on_disk(path) as record:
                    broken += [*sample_rules(record, bench.rig.runs)]
        broken += [f"a thread is left: {name}" for name in left_since(before)]
    if path is not None:
        with open_datafile(path) as record:
            broken += [*sample_rules(record, bench.rig.runs), *record_rules(record, story, fault)]
    fired = bench.begun and (bool(bench.rig.struck) or not fault.recorded)
    return Verdict(fault.name, place.name, fired, not bench.begun, noticed, story.status, story.reason, tuple(broken))


@contextmanager
def on_disk(path: Path) -> Iterator[DataFile]:
    """The bytes that are on the disk, read elsewhere: the file itself is still held."""
    with TemporaryDirectory() as elsewhere:
        shutil.copytree(path.parent, elsewhere, dirs_exist_ok=True)
        with open_datafile(Path(elsewhere) / path.name) as record:
            yield record


@contextmanager
def disk_of(fault: Fault) -> Iterator[None]:
    """A recorder that gives up soon, where that is what is tried."""
    with pytest.MonkeyPatch.context() as patch:
        if fault.disk in ("hung", "slow"):
            patch.setattr(recording, "BACKLOG", SMALL_BACKLOG)
            patch.setattr(recording, "PATIENCE", SHORT_PATIENCE if fault.disk == "hung" else recording.PATIENCE)
        yield


def left_since(before: set[threading.Thread]) -> list[str]:
    """Names of the threads that came since and do not end."""
    new = set(threading.enumerate()) - before
    for thread in new:
        thread.join(LONG)
    return [thread.name for thread in new if thread.is_alive()]


def was_noticed(story: Story, fault: Fault) -> bool:
    """Whether the run's end, its journal or the closing of its file names the fault."""
    told = [story.reason, *story_notes(story), str(story.close_error or "")]
    told += [event.quantity for event in story.bench.events if isinstance(event, LimitExceeded)]
    return bool(fault.says) and any(says in text for text in told for says in fault.says.split("|"))


def story_notes(story: Story) -> list[str]:
    """What was noted on the exception that was raised."""
    return list(getattr(story.raised, "__notes__", []))


def ending_rules(story: Story, fault: Fault, place: Place, noticed: bool) -> Iterator[str]:
    """How it ended, and through which states."""
    base = BASE[place.asked]
    if not story.bench.begun:
        yield "the fault was never injected"
    if fault.must(place, story.bench) and not noticed:
        yield "not noticed"
    if noticed and not (fault.must(place, story.bench) or fault.may):
        yield "noticed where it should be borne"
    raises = fault.raises if noticed else None
    if (story.raised is not None) != (raises is not None) or not isinstance(story.raised, raises or type(None)):
        yield f"raised {story.raised!r}"
    told_at_closing = story.close_error is not None and fault.says in str(story.close_error)
    if story.close_error is not None and not (fault.disk and told_at_closing):
        yield f"closing the file raised {story.close_error!r}"
    expected = {max(base, status, key=SEVERITY.index) for status in fault.status.split("|")} if noticed else {base}
    if noticed and told_at_closing:
        expected.add(base)
    if story.raised is None and story.status not in expected:
        yield f"ended as {story.status}, not as {' or '.join(expected)}"
    changes = [event for event in story.bench.events if isinstance(event, StateChanged)]
    for event in changes:
        if event.after not in TRANSITIONS[event.before]:
            yield f"went from {event.before} to {event.after}"
    if story.ending is not None and story.bench.engine.state is not State.CLOSED:
        yield f"ended in the state {story.bench.engine.state}"


def output_rules(story: Story, fault: Fault) -> Iterator[str]:
    """What reached the shaker, how the table moved, and that both are at rest."""
    rig = story.bench.rig
    for run_ in rig.runs:
        yield from drive_rules(run_, LIMITS, RATE)
        if not fault.moves:
            yield from table_rules(run_, LIMITS)
    ramped = rig.runs if story.status in RAMPED else rig.runs[:-1]
    for run_ in ramped:
        if run_.drive[run_.read - 1 :].any():
            yield f"the output ended at {run_.drive[run_.read - 1]:.3g} V"
    if story.status in RAMPED and rig.cuts:
        yield "the enable line was cut"
    if story.armed and not fault.disobeys:
        yield "the rig is armed at the end"
    rig.close()
    if rig.armed:
        yield "the rig is armed after it was closed"
    if rig.runs:
        yield from unrest(rig.inner.bench, within=rig.gain == 1.0)


def drive_rules(run_: Run, limits: Limits, rate: float) -> Iterator[str]:
    """No command beyond the limits, none faster than the slew limit, at `rate` samples per second."""
    drive = run_.drive
    if np.abs(drive).max(initial=0.0) > limits.drive_voltage or not np.isfinite(drive).all():
        yield f"{np.abs(drive).max():.3g} V were written"
    step = np.abs(np.diff(drive, prepend=0.0)).max(initial=0.0) * rate
    if step > limits.drive_slew * (1.0 + 1e-9):
        yield f"the drive changed by {step:.3g} V/s"


def table_rules(run_: Run, limits: Limits) -> Iterator[str]:
    """The true motion of the table within its limits."""
    for peak, limit in zip(run_.peaks, (limits.displacement, limits.velocity, limits.acceleration), strict=True):
        if peak > limit:
            yield f"the table reached {peak:.3g} where {limit:g} is allowed"


def unrest(virtual: VirtualBench, *, within: bool = True) -> Iterator[str]:
    """Let time pass at zero drive; the virtual bench must come to rest, its table `within` the limits on the way."""
    speed = np.inf
    for _ in range(REST):
        virtual.coast(1.0)
        truth = virtual.truth
        if within and not (_within(truth.x, LIMITS.displacement) and _within(truth.v, LIMITS.velocity)):
            yield "the table went beyond a limit after the end"
        rest = slice(-round(0.1 * RATE), None)
        speed = max(float(np.abs(part[rest]).max()) for part in (truth.v, truth.v1, truth.v2, truth.x))
        if speed <= STILL:
            return
    yield f"the bench still moves with {speed:.2g} m/s"


def _within(values: NDArray[np.float64], limit: float) -> bool:
    return bool(np.abs(values).max() <= limit)


def sample_rules(record: DataFile, runs: Sequence[Run]) -> Iterator[str]:
    """What is in the file is what was played."""
    blocks, drive = record.blocks, record.drive()
    edges = [*blocks["row"].tolist(), record.rows]
    for start, end, run_, first in zip(edges, edges[1:], blocks["run"], blocks["first"], strict=False):
        played = runs[run_ - 1].drive[first : first + end - start]
        if not np.array_equal(drive[start:end], played.astype(np.float32)):
            yield f"the recorded drive of run {run_} from {first} on is not what was played"


def record_rules(record: DataFile, story: Story, fault: Fault) -> Iterator[str]:
    """The file says how it ended; one whose disk failed is as a killed writer leaves it."""
    untold = fault.disk in ("full", "hung") and record.status == "running"
    if untold:
        return
    if record.status != story.status or record.summary != story.reason:
        yield f"the file says {record.status}: {record.summary}"
    if story.close_error is None and not fault.disk:
        states = [event.text for event in record.events if event.kind == "StateChanged"]
        if story.ending is not None and (not states or f"-> {State.CLOSED}" not in states[-1]):
            yield "the journal has no end"
