"""Puts one fault into one campaign on the emulated bench, and holds what came of it against the rules."""

import threading
import time
from dataclasses import dataclass
from pathlib import Path

from bench.datafile.reader import open_datafile
from drivers.errors import RigError
from tests.faults.audit import (
    Verdict,
    disk_of,
    ending_rules,
    left_since,
    on_disk,
    record_rules,
    sample_rules,
    was_noticed,
)
from tests.faults.bench import run
from tests.faults.emulated.bench import WiredBench
from tests.faults.emulated.fault import WiredFault
from tests.faults.emulated.setup import SETTING
from tests.faults.emulated.truth import end_rules, motion_rules, played_rules, rest_rules
from tests.faults.places import Place

_BEAT = 0.005
_LATE = 0.2 * SETTING.lead / SETTING.rate
"""A turn of the loop waits for several threads in turn, each of which a machine that is so late [s] holds up."""
_SAYS_LATE = ("the drive was written too late", "delay of a block", "DEADLINE_EXCEEDED", "after its block was due")
"""What the program says of a machine that is too late for it."""


@dataclass(frozen=True)
class Judgement:
    """A verdict; it is `void`, and to be tried again, when a rule was broken while the machine was too late for real
    time. What drive and table did counts in every attempt."""

    verdict: Verdict
    void: bool


class Metronome:
    """Tells by how much the machine was late at most while it beat [s]: threads that do nothing else oversleep."""

    def __init__(self) -> None:
        self.latest = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="metronome", daemon=True)

    def __enter__(self) -> "Metronome":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _beat(self) -> None:
        while not self._over.is_set():
            asleep = time.perf_counter()
            time.sleep(_BEAT)
            self.latest = max(self.latest, time.perf_counter() - asleep - _BEAT)


def judge(fault: WiredFault, place: Place, folder: Path) -> Judgement:
    """Put `fault` into a campaign at `place`."""
    with Metronome() as metronome:
        verdict, unsafe = _judged(fault, place, folder)
    # a campaign that ended before its fault came ended of something else
    late = metronome.latest > _LATE or verdict.lost or any(word in verdict.reason for word in _SAYS_LATE)
    return Judgement(verdict, bool(verdict.broken) and not unsafe and late)


def _judged(fault: WiredFault, place: Place, folder: Path) -> tuple[Verdict, bool]:
    """The verdict, and whether a rule of safety is among those that were broken."""
    before = set(threading.enumerate())
    path = folder / "campaign.h5"
    broken: list[str] = []
    with disk_of(fault):
        try:
            bench = WiredBench(
                path, place, fault.begin, fault.connection, watchdog=fault.watchdog, heartbeat=fault.heartbeat
            )
        except RigError as error:
            return Verdict(fault.name, place.name, False, True, False, "failed", str(error), ("not opened",)), False
        try:
            story = run(bench)
            fired = fault.fired(bench)
            noticed = was_noticed(story, fault)
            if fault.disk == "hung" and noticed:
                with on_disk(path) as record:
                    broken += sample_rules(record, bench.rig.runs)
            bench.disk.free.set()
            bench.rig.close()
            unsafe = list(end_rules(bench, fault))
            truth = bench.witness.told()
        finally:
            bench.disk.free.set()
            bench.laboratory.close()
    unsafe += [*motion_rules(truth, story), *rest_rules(bench.witness)]
    broken += [*ending_rules(story, fault, place, noticed), *played_rules(bench, truth)]
    broken += [f"a thread is left: {name}" for name in left_since(before)]
    if not fired:
        broken.append("lost: it never struck")
    with open_datafile(path) as record:
        broken += [*sample_rules(record, bench.rig.runs), *record_rules(record, story, fault)]
    rules = (*unsafe, *broken)
    return Verdict(fault.name, place.name, fired, not fired, noticed, story.status, story.reason, rules), bool(unsafe)
