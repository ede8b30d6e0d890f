"""Many campaigns at once, each with its own laboratory in a process that does nothing else: most of each is waiting."""

import multiprocessing
import os
import tempfile
from collections.abc import Iterable
from concurrent.futures import Future, ProcessPoolExecutor, wait
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from tests.faults.audit import Verdict
from tests.faults.emulated.catalogue import catalogue
from tests.faults.emulated.fault import WiredFault
from tests.faults.emulated.judge import Judgement, judge
from tests.faults.emulated.setup import PLACES
from tests.faults.places import ORDER, Place

_PER_CORE = {False: 2, True: 1}
"""How many campaigns at a time: without serial lasers, and with."""
_ALONE = 2


@dataclass(frozen=True)
class Case:
    """A fault at a place, by their names; `heavy` when serial lasers stream meanwhile, most of what is to be done."""

    fault: str
    place: str
    heavy: bool


def cases(*, core: bool = False) -> list[Case]:
    """Every fault at every place where it can strike, or at those of the core."""
    places = [place for place in PLACES if place.core or not core]
    return [_case(fault, place) for fault in catalogue() for place in places if fault.reach(place)]


def few() -> list[Case]:
    """Every fault once, and every place of the core at least once: the places take turns.

    What is heavy is put in early: most of it ends the run.
    """
    used = dict.fromkeys((place.name for place in PLACES if place.core), 0)
    found: list[Case] = []
    for fault in catalogue():
        early = ORDER["following" if fault.connection == "serial" else "closed"]
        places = [name for name in used if ORDER[name] <= early and fault.reach(_place(name))]
        name = min(places, key=lambda name: used[name])
        used[name] += 1
        found.append(_case(fault, _place(name)))
    return found


class Campaigns:
    """Begins to judge all that is asked for, as many at a time as the machine has time for.

    `void` counts the attempts that were repeated because the machine was too late: a mistake of the program comes
    again.
    """

    def __init__(self, asked: Iterable[Case]) -> None:
        # what is imported and compiled there is there for all; nothing is forked that has run a laboratory
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["tests.faults.emulated.preload"])
        cores = os.cpu_count() or 1
        with ExitStack() as opened:
            self._pools = {heavy: ProcessPoolExecutor(n * cores, mp_context=context) for heavy, n in _PER_CORE.items()}
            self._alone = ProcessPoolExecutor(1, mp_context=context)
            for pool in (*self._pools.values(), self._alone):
                opened.callback(pool.shutdown, cancel_futures=True)
            self.void, self._repeated = 0, False
            self._found: dict[Case, Future[Judgement]] = {
                case: self._pools[case.heavy].submit(_judge, case) for case in asked
            }
            self._opened = opened.pop_all()

    def verdict(self, case: Case) -> Verdict:
        """What came of a case; waits for it. One that is void is repeated with all others that are, then alone."""
        if self._found[case].result().void:
            self._repeat()
        judgement = self._found[case].result()
        for _ in range(_ALONE):
            if not judgement.void:
                break
            wait(self._found.values())
            self.void += 1
            judgement = self._alone.submit(_judge, case).result()
        return judgement.verdict

    def _repeat(self) -> None:
        """Judge once more what is void, when all has been judged; the first time that this is asked for."""
        if not self._repeated:
            self._repeated = True
            wait(self._found.values())
            void = [case for case, judged in self._found.items() if judged.result().void]
            self.void += len(void)
            self._found |= {case: self._pools[case.heavy].submit(_judge, case) for case in void}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()


def _case(fault: WiredFault, place: Place) -> Case:
    return Case(fault.name, place.name, fault.connection == "serial")


def _place(name: str) -> Place:
    return next(place for place in PLACES if place.name == name)


def _judge(case: Case) -> Judgement:
    """In a worker."""
    fault = next(fault for fault in catalogue() if fault.name == case.fault)
    with tempfile.TemporaryDirectory() as folder:
        return judge(fault, _place(case.place), Path(folder))
