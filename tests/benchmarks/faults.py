"""Every fault at every place of a short campaign, on the simulated and on the emulated bench, and how fast the guard
reacts.

    python -m tests.benchmarks.faults                     all of it, half an hour on two cores
    python -m tests.benchmarks.faults --bench simulated   the virtual bench only, three minutes
    python -m tests.benchmarks.faults --only laser        faults whose name contains a text
    python -m tests.benchmarks.faults --trips 1000        1000 reactions of the profile fast at random phases, on the
                                                          virtual bench; --bench emulated: in real time on the device,
                                                          called without a network; --networked: through gRPC, with
                                                          the profile for it
    python -m tests.benchmarks.faults --reaction          the table of reaction times only

Prints, for every fault and for every state of the engine, at how many places it was put in, how often it struck, how
the runs ended, and how many broke a rule of `tests.faults.audit` or `tests.faults.emulated.truth`; each offender with
all that it takes to look at it again. Ends with exit status 1 if there was one, if a fault was lost, or if a reaction
took longer than promised.

On the simulated bench every fault is put everywhere, also where nothing is left that it could strike; on the emulated
one only where it must strike, and one that does not is lost.
"""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from bench.config.sections import FAST, FAST_OVER_NETWORK
from bench.engine.interface import SEVERITY
from tests.faults.audit import Verdict, judge
from tests.faults.catalogue import catalogue
from tests.faults.places import PLACES
from tests.faults.reaction import RATE, Reaction, react

BLOCKS, LEADS = (0.02, 0.05, 0.1, 0.2), (0.0, 0.05, 0.1)
"""Seconds."""
PHASES = np.linspace(0.0, 1.0, 24, endpoint=False)


STATES = {place.name: str(place.state) for place in PLACES}


def simulated(only: str) -> Iterator[Verdict]:
    """Every fault whose name contains `only`, at every place of the virtual bench."""
    with TemporaryDirectory() as folder:
        for fault in catalogue():
            if only in fault.name:
                for place in PLACES:
                    yield judge(fault, place, Path(folder))


def emulated(only: str) -> Iterator[Verdict]:
    """The same on the emulated bench, many at once, wherever it can strike."""
    from tests.faults.emulated.pool import Campaigns, cases

    asked = [case for case in cases() if only in case.fault]
    with Campaigns(asked) as begun:
        for case in asked:
            yield begun.verdict(case)
        print(f"{begun.void} campaigns were repeated because the machine was too late for real time")


def table(found: list[Verdict]) -> str:
    """A line for each fault, for each state and for all: put in, struck, lost, noticed, endings, rules broken."""
    heads = ["put in", "struck", "lost", "noticed", *SEVERITY, "offenders"]
    lines = [f"{'':42}" + "".join(f"{head:>10}" for head in heads)]
    groups = {verdict.fault: [one for one in found if one.fault == verdict.fault] for verdict in found}
    for state in dict.fromkeys(STATES.values()):
        groups[f"state: {state}"] = [verdict for verdict in found if STATES[verdict.place] == state]
    groups["all"] = found
    for name, mine in groups.items():
        ends = Counter(verdict.status for verdict in mine)
        numbers = [len(mine), sum(verdict.fired for verdict in mine), sum(verdict.lost for verdict in mine)]
        numbers += [sum(verdict.noticed for verdict in mine), *(ends[status] for status in SEVERITY)]
        numbers.append(sum(bool(verdict.broken) for verdict in mine))
        lines.append(f"{name:42}" + "".join(f"{number:10d}" for number in numbers))
    return "\n".join(lines)


def report(bench: str, found: list[Verdict]) -> bool:
    """Print what one bench gave; whether all was as it should be."""
    offenders = [verdict for verdict in found if verdict.broken or verdict.lost]
    print(f"The {bench} bench:\n{table(found)}")
    print("\n".join(str(verdict) for verdict in offenders), flush=True)
    return bool(found) and not offenders


FASTEST = 20.0
"""Longest reaction of the profile fast [ms]."""


def matrix(bench: str, only: str) -> bool:
    """Put all that goes wrong into one bench; whether all was as it should be."""
    return report(bench, list({"simulated": simulated, "emulated": emulated}[bench](only)))


def reactions() -> list[list[Reaction]]:
    """For each block length and lead, the reactions at many phases."""
    sizes = [(round(block * RATE), round(lead * RATE)) for block in BLOCKS for lead in LEADS]
    return [[react(block, lead, float(phase)) for phase in PHASES] for block, lead in sizes]


def reaction_table(found: list[list[Reaction]]) -> str:
    """From the first sample beyond the limit to the first changed output sample, in samples and milliseconds."""
    heads = ["block [ms]", "lead [ms]", "promised", "mean", "longest", "longest [ms]", "of truth [ms]"]
    lines = ["".join(f"{head:>15}" for head in heads)]
    for group in found:
        first, measured = group[0], [one.measured for one in group]
        longest, truth = max(measured), max(one.truth for one in group)
        cells = [f"{1e3 * first.block / RATE:.0f}", f"{1e3 * first.lead / RATE:.0f}", str(first.promised)]
        cells += [f"{np.mean(measured):.0f}", str(longest), f"{1e3 * longest / RATE:.1f}", f"{1e3 * truth / RATE:.1f}"]
        lines.append("".join(f"{cell:>15}" for cell in cells))
    return "\n".join(lines)


def trips(count: int, bench: str, *, networked: bool) -> bool:
    """Print a histogram of reactions in the profile fast at random phases; whether all are as promised, in 20 ms.
    `networked`: the profile for a device behind a gRPC server."""
    block, lead = (round(seconds * RATE) for seconds in (FAST_OVER_NETWORK if networked else FAST))
    phases = np.random.default_rng(1).uniform(size=count).tolist()
    if bench == "emulated":
        from tests.faults.emulated.reaction import reactions_in_real_time

        tried = list(reactions_in_real_time(block, lead, phases, local=not networked))
        found = [one for one in tried if isinstance(one, Reaction)]
        void = [one for one in tried if not isinstance(one, Reaction)]
        print(f"{len(void)} of {count} runs ended earlier, because the machine was too late for real time")
        for told, number in Counter(f"{type(one).__name__}: {one}" for one in void).items():
            print(f"{number:5d} {told}")
        if not found:
            return False
    else:
        found = [react(block, lead, phase) for phase in phases]
    times = np.array([one.measured for one in found]) * 1e3 / RATE
    print(f"{len(found)} trips in the profile fast, promised {1e3 * found[0].promised / RATE:.1f} ms:")
    for low in np.arange(np.floor(times.min()), times.max() + 1e-9):
        number = int(np.count_nonzero((times >= low) & (times < low + 1.0)))
        print(f"{low:5.0f} ms {number:5d} {'#' * round(60 * number / count)}")
    within = bool(times.max() <= FASTEST) and all(one.measured <= one.promised for one in found)
    print(f"worst {times.max():.1f} ms, allowed {FASTEST:.0f} ms: {'met' if within else 'NOT MET'}")
    return within


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--reaction", action="store_true")
    parser.add_argument("--bench", choices=("simulated", "emulated", "both"), default="both")
    parser.add_argument("--trips", type=int, default=0, help="reactions at so many random phases, and nothing else")
    parser.add_argument("--networked", action="store_true", help="blocks and lead for a device behind a gRPC server")
    options = parser.parse_args()
    if options.trips:
        return int(not trips(options.trips, options.bench, networked=options.networked))
    begin = perf_counter()
    both = ("simulated", "emulated") if os.name == "posix" else ("simulated",)
    benches = both if options.bench == "both" else (options.bench,)
    good = all([] if options.reaction else [matrix(bench, options.only) for bench in benches])
    times = reactions()
    print(f"From the first sample beyond a limit to the first changed sample of the output, at {RATE:g} samples/s:")
    print(reaction_table(times))
    print(f"{perf_counter() - begin:.0f} s")
    return int(not good or any(one.measured > one.promised for group in times for one in group))


if __name__ == "__main__":
    sys.exit(main())
