"""Audit of the stated uncertainties: every quantity on many drawn benches, and the table of docs/accuracy.md.

    python -m tests.benchmarks.audit [--benches 200] [--only NAMES] [--processes 2]    # extends the stored results
    python -m tests.benchmarks.audit --list                                            # studies, benches stored, cost
    python -m tests.benchmarks.audit --anew NAMES                                      # discards what is stored first
    python -m tests.benchmarks.audit --benches 0 --write                               # the table from what is stored

The rows of studies of which nothing is stored stay as they are.

`NAMES` are studies or beginnings of their names, such as `frame` or "alpha_2, default". The benches are carried out in
rounds of `ROUND` of each study, those with little cost first, and are stored in a JSON file (`--results`) every few
seconds, so that an interrupted audit is resumed. After a change of an estimate or its budget, use `--anew`.
"""

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from time import monotonic

from bench.unfinished import replace
from tests.benchmarks.audit_studies import Outcome, Study, studies
from tests.benchmarks.estimates import Estimate, Omitted, Statistics
from tests.pages.blocks import ROOT

PAGE = ROOT / "docs" / "accuracy.md"
COMMAND = "python -m tests.benchmarks.audit --write"
BEGIN, END = f"<!-- written by `{COMMAND}`: do not edit -->", "<!-- end of the written table -->"

ROUND = 10
"""Benches of every study before any has more."""

STORED_AFTER = 10.0
"""Seconds after which new results are stored."""

Stored = dict[str, dict[int, Outcome]]
"""Results by study and seed."""


def read(path: Path) -> Stored:
    """The stored results; none if there is no file."""
    if not path.exists():
        return {}
    return {
        name: {int(seed): _outcome(one) for seed, one in benches.items()}
        for name, benches in json.loads(path.read_text(encoding="utf-8")).items()
    }


def write(path: Path, results: Stored) -> None:
    """Store the results, replacing the file at once."""
    plain = {
        name: {seed: one.reason if isinstance(one, Omitted) else one for seed, one in benches.items()}
        for name, benches in results.items()
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
        json.dump(plain, file)
    replace(Path(file.name), path)


def _outcome(stored: str | dict[str, list[float]]) -> Outcome:
    if isinstance(stored, str):
        return Omitted(stored)
    return {key: Estimate(*numbers) for key, numbers in stored.items()}


def selected(names: Sequence[str]) -> list[Study]:
    """The studies whose names begin with one of `names`; all if there are none. Raises SystemExit if none does."""
    found = [one for name, one in studies().items() if not names or name.startswith(tuple(names))]
    if not found:
        raise SystemExit(f"no study begins with {' or '.join(names)}")
    return found


def carried_out(job: tuple[str, int]) -> Outcome:
    """The bench of a study and seed."""
    name, seed = job
    return studies()[name].bench(seed)


def jobs(asked: Iterable[Study], results: Stored, benches: int) -> Iterator[tuple[str, int]]:
    """Studies and seeds that are missing, in rounds, those with little cost first."""
    ordered = sorted(asked, key=lambda one: one.seconds)
    for first in range(0, benches, ROUND):
        for one in ordered:
            done = results.get(one.name, {})
            yield from ((one.name, seed) for seed in range(first, min(first + ROUND, benches)) if seed not in done)


def extend(asked: Iterable[Study], results: Stored, path: Path, benches: int, processes: int) -> None:
    """Carry out the missing benches, and store them."""
    missing = list(jobs(asked, results, benches))
    stored = monotonic()
    with _mapped(processes) as mapped:
        for (name, seed), outcome in zip(missing, mapped(carried_out, missing), strict=True):
            results.setdefault(name, {})[seed] = outcome
            if monotonic() - stored > STORED_AFTER or (name, seed) == missing[-1]:
                write(path, results)
                print(f"{name}: {len(results[name])} benches", file=sys.stderr, flush=True)
                stored = monotonic()


Mapped = Callable[[Callable[[tuple[str, int]], Outcome], Sequence[tuple[str, int]]], Iterable[Outcome]]


@contextmanager
def _mapped(processes: int) -> Generator[Mapped]:
    """`map` in this process, or divided among so many others."""
    if processes == 1:
        yield map
    else:
        with get_context("spawn").Pool(processes) as pool:
            yield pool.imap


HEADING = (
    "| quantity | case | n (omitted) | U | covered [%] | rms e | mean e |",
    "|---|---|---|---|---|---|---|",
)


def table(asked: Iterable[Study], results: Stored, before: Sequence[str] = ()) -> list[str]:
    """Lines of the table for the studies of which benches are stored; of the others, those of the table `before`."""
    lines = list[str](HEADING)
    for study in asked:
        outcomes = list(results.get(study.name, {}).values())
        measured = [one for one in outcomes if not isinstance(one, Omitted)]
        omitted = len(outcomes) - len(measured)
        for key, symbol in study.quantities.items():
            begin = f"| {symbol} | {study.case} | "
            if len(measured) > 1:
                found = Statistics.of([one[key] for one in measured])
                lines.append(f"{begin}{_row(study, key, found, omitted)} |")
            elif not outcomes:
                lines += [line for line in before if line.startswith(begin)]
    return lines


def _row(study: Study, key: str, found: Statistics, omitted: int) -> str:
    unit, factor = study.units.get(key, ("%", 0.0))
    expanded = found.expanded * factor if factor else 100.0 * found.relative
    interval = f"{100.0 * found.low:.0f} to {100.0 * found.high:.0f}"
    covered, rms = f"{100.0 * found.covered:.1f} ({interval})", f"{found.rms:.2f}"
    mark = "**" if found.conspicuous else ""
    parts = (
        f"{found.n} ({omitted})" if omitted else f"{found.n}",
        f"{_two_digits(expanded)} {unit}".strip(),
        f"{mark}{covered}{mark}",
        f"{mark}{rms}{mark}",
        f"{found.mean:+.2f}".replace("-", "−"),
    )
    return " | ".join(parts)


def _two_digits(number: float) -> str:
    return f"{number:.0f}" if number >= 100.0 else f"{number:#.2g}".removesuffix(".")


def with_table(page: str, lines: Sequence[str]) -> str:
    """The page with these lines between its marks. Raises ValueError without the marks."""
    before, rest = page.split(f"{BEGIN}\n", 1)
    _, after = rest.split(f"{END}\n", 1)
    return f"{before}{BEGIN}\n\n" + "\n".join(lines) + f"\n\n{END}\n{after}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Extend the results, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=200, help="benches of each study, with those stored")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="studies")
    parser.add_argument("--anew", nargs="+", default=[], metavar="NAME", help="discard their stored benches")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--results", type=Path, default=Path.home() / ".cache" / "rockbench" / "audit.json")
    parser.add_argument("--list", action="store_true", help="print the studies only")
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.relative_to(ROOT)}")
    asked = parser.parse_args(arguments)
    chosen, results = selected(asked.only), read(asked.results)
    if asked.list:
        for one in chosen:
            done = results.get(one.name, {})
            reasons = Counter(each.reason for each in done.values() if isinstance(each, Omitted))
            print(f"{one.name:40} {len(done):4d} benches, {one.seconds:g} s each {dict(reasons) or ''}")
        return
    if asked.anew:
        for one in selected(asked.anew):
            results.pop(one.name, None)
    extend(chosen, results, asked.results, asked.benches, asked.processes)
    if asked.write:
        page = PAGE.read_text(encoding="utf-8")
        lines = table(studies().values(), results, page.splitlines())
        PAGE.write_text(with_table(page, lines), encoding="utf-8", newline="\n")
    else:
        print("\n".join(table(chosen, results)))


if __name__ == "__main__":
    main()
