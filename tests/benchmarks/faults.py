"""Every fault at every place of a short campaign, and how fast the guard reacts.

    python -m tests.benchmarks.faults                all of it, two minutes
    python -m tests.benchmarks.faults --only sensor  faults whose name contains a text
    python -m tests.benchmarks.faults --reaction     the table of reaction times only

Prints, for every fault, at how many places it was put in, how the runs ended, and how many broke a rule of
`tests.faults.audit`; each offender with all that it takes to look at it again. Ends with exit status 1 if there was
one, if a fault was lost, or if a reaction took longer than promised.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from bench.engine.ending import SEVERITY
from tests.faults.audit import Verdict, judge
from tests.faults.catalogue import catalogue
from tests.faults.places import PLACES
from tests.faults.reaction import RATE, Reaction, react

BLOCKS, LEADS = (0.02, 0.05, 0.1, 0.2), (0.0, 0.05, 0.1)
"""Seconds."""
PHASES = np.linspace(0.0, 1.0, 24, endpoint=False)


def verdicts(only: str) -> Iterator[Verdict]:
    """Every fault whose name contains `only`, at every place."""
    with TemporaryDirectory() as folder:
        for fault in catalogue():
            if only in fault.name:
                for place in PLACES:
                    yield judge(fault, place, Path(folder))


def table(found: list[Verdict]) -> str:
    """One line for each fault and one for all: injected, noticed, endings, rules broken."""
    heads = ["injected", "lost", "noticed", *SEVERITY, "offenders"]
    lines = [f"{'fault':42}" + "".join(f"{head:>10}" for head in heads)]
    names = list(dict.fromkeys(verdict.fault.name for verdict in found))
    for name in (*names, "all"):
        mine = [verdict for verdict in found if name in (verdict.fault.name, "all")]
        ends = Counter(verdict.status for verdict in mine)
        injected, noticed = (sum(of) for of in zip(*((v.injected, v.noticed) for v in mine), strict=True))
        numbers = [injected, len(mine) - injected, noticed, *(ends[status] for status in SEVERITY)]
        numbers.append(sum(bool(verdict.broken) for verdict in mine))
        lines.append(f"{name:42}" + "".join(f"{number:10d}" for number in numbers))
    return "\n".join(lines)


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


def main() -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--reaction", action="store_true")
    options = parser.parse_args()
    begin, wrong = perf_counter(), False
    if not options.reaction:
        found = list(verdicts(options.only))
        offenders = [verdict for verdict in found if verdict.broken or not verdict.injected]
        print(table(found))
        print("\n".join(str(verdict) for verdict in offenders))
        wrong = bool(offenders) or not found
    times = reactions()
    print(f"From the first sample beyond a limit to the first changed sample of the output, at {RATE:g} samples/s:")
    print(reaction_table(times))
    print(f"{perf_counter() - begin:.0f} s")
    return int(wrong or any(one.measured > one.promised for group in times for one in group))


if __name__ == "__main__":
    sys.exit(main())
