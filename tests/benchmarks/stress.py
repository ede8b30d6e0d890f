"""A million scenes made to break the integrator, audited one by one.

    python -m tests.benchmarks.stress                      all of it, a few minutes on two processors
    python -m tests.benchmarks.stress --cases 20000        a taste
    python -m tests.benchmarks.stress --kind chatter       one kind of trouble only

Prints, for every kind, how many cases there were, how they ended, and how many broke a rule of
`tests.benchmarks.stress_audit`; each offender is printed with all that it takes to run it again. Ends with exit
status 1 if there was one, or if a chunk of cases did not come back in time.
"""

import argparse
import sys
from collections import Counter
from concurrent.futures import Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from sim.rocking import Status
from tests.benchmarks.stress_audit import audit
from tests.benchmarks.stress_cases import KINDS

CHUNK = 1000
LONGEST_LINE = 600
PATIENCE = 600.0
"""Seconds without any chunk coming back after which the run counts as hung."""


@dataclass
class Tally:
    """What became of the cases of one kind."""

    cases: int = 0
    impacts: int = 0
    outcomes: Counter[str] = field(default_factory=Counter[str])
    faults: Counter[str] = field(default_factory=Counter[str])
    offenders: list[str] = field(default_factory=list[str])
    slowest: float = 0.0

    def add(self, other: "Tally") -> None:
        """Count another tally in."""
        self.cases += other.cases
        self.impacts += other.impacts
        self.outcomes += other.outcomes
        self.faults += other.faults
        self.offenders += other.offenders
        self.slowest = max(self.slowest, other.slowest)


def run_chunk(kind: str, seed: int, chunk: int, cases: int) -> Tally:
    """Draw and audit some cases of one kind; `seed` and `chunk` decide which."""
    make, _ = KINDS[kind]
    rng = np.random.default_rng([seed, list(KINDS).index(kind), chunk])
    tally = Tally()
    for i in range(cases):
        case, choice = make(rng), float(rng.random())
        begin = perf_counter()
        motion, faults = audit(case, choice)
        tally.slowest = max(tally.slowest, perf_counter() - begin)
        tally.cases += 1
        tally.impacts += motion.impacts
        tally.outcomes[motion.status.value] += 1
        tally.faults.update(faults)
        if faults:
            where = f"{kind}, seed {seed}, chunk {chunk}, case {i}, choice {choice!r}"
            scene = f"{case.specimen!r} {case.state!r} {case.excitation.packed().tolist()}"
            tally.offenders.append(f"{', '.join(faults)}: {where}: {motion.status.value}: {scene}"[:LONGEST_LINE])
    return tally


def shares(cases: int, only: str | None = None) -> dict[str, int]:
    """How many cases each kind gets; together at least `cases`."""
    kinds = {name: weight for name, (_, weight) in KINDS.items() if only in (None, name)}
    total = sum(kinds.values())
    return {name: -(-cases * weight // total) for name, weight in kinds.items()}


def run_all(cases: int, seed: int, processes: int, only: str | None = None) -> dict[str, Tally]:
    """Tallies by kind. Raises TimeoutError when nothing comes back for PATIENCE seconds."""
    tallies = {kind: Tally() for kind in shares(cases, only)}
    with ProcessPoolExecutor(processes) as pool:
        futures: dict[Future[Tally], str] = {}
        for kind, share in shares(cases, only).items():
            for chunk in range(-(-share // CHUNK)):
                size = min(CHUNK, share - chunk * CHUNK)
                futures[pool.submit(run_chunk, kind, seed, chunk, size)] = kind
        pending = set(futures)
        while pending:
            done, pending = wait(pending, timeout=PATIENCE, return_when="FIRST_COMPLETED")
            if not done:
                raise TimeoutError(f"hung, among {sorted({futures[future] for future in pending})}")
            for future in done:
                tallies[futures[future]].add(future.result())
    return tallies


def table(tallies: dict[str, Tally]) -> str:
    """The counts as text, one line for each kind and one for all."""
    total = Tally()
    for tally in tallies.values():
        total.add(tally)
    heads = ["cases", "impacts", *(status.value for status in Status), "faults", "slowest [ms]"]
    lines = [f"{'kind':20}" + "".join(f"{head:>20}" for head in heads)]
    for kind, tally in {**tallies, "all": total}.items():
        ends = [tally.outcomes[status.value] for status in Status]
        numbers = [tally.cases, tally.impacts, *ends, sum(tally.faults.values())]
        lines.append(f"{kind:20}" + "".join(f"{number:20d}" for number in numbers) + f"{1e3 * tally.slowest:20.1f}")
    lines += [f"{count} x {fault}" for fault, count in total.faults.items()]
    return "\n".join(lines)


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--kind", choices=list(KINDS))
    options = parser.parse_args()
    begin = perf_counter()
    tallies = run_all(options.cases, options.seed, options.processes, options.kind)
    print(table(tallies))
    print(f"seed {options.seed}, {perf_counter() - begin:.0f} s")
    offenders = [offender for tally in tallies.values() for offender in tally.offenders]
    print("\n".join(offenders[:20]))
    return 1 if offenders else 0


if __name__ == "__main__":
    sys.exit(main())
