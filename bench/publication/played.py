"""Where in a file an earthquake record was played, and what the bench showed."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import SignalMap
from bench.events import RunningGain
from bench.record.reader import Record

Floats = NDArray[np.float64]

QUIET = 1.5
"""Time at the beginning of a run from which the zero of the signals is taken [s]: the table rests for 2 s."""


@dataclass(frozen=True)
class Played:
    """A record, played once: rows of the file from the drive's begin to its last gain; `run`: where its run begins."""

    name: str
    beta: float | None
    run: int
    start: int
    stop: int


def played_records(record: Record) -> list[Played]:
    """Every play of the file that was watched, in order; `beta` is None for the bare frame."""
    gains, blocks = record.columns_of(RunningGain), record.blocks
    found: list[Played] = []
    if not gains:
        return found
    rows, runs, times = (blocks[column] for column in ("row", "run", "time"))
    for time, name, beta, seconds in zip(
        *(gains[column] for column in ("time", "record", "beta", "seconds")), strict=True
    ):
        block = bisect_right(times, time + 1e-6) - 1
        if block < 0:
            continue
        stop = int(rows[block + 1]) if block + 1 < rows.size else record.rows
        begin = int(rows[bisect_left(runs, runs[block])])
        samples = round(seconds * record.sample_rate)
        one = Played(str(name), None if beta is None else float(beta), begin, stop - samples, stop)
        # one play grows block by block; another one begins elsewhere
        if found and (found[-1].run, found[-1].name, found[-1].beta) == (one.run, one.name, one.beta):
            # the last gain ends within a block, the first one at the end of one: only that tells where the play begins
            start = found.pop().start
            one = replace(one, start=start, stop=start + samples)
        found.append(one)
    return [one for one in found if one.start >= one.run]


def signals_of(record: Record, signals: SignalMap, played: Played) -> Floats:
    """Signals of the play, shape (n, n_signals), counted from the zero at rest."""

    def values(start: int, stop: int) -> Floats:
        return np.column_stack([record.values(channel.name, slice(start, stop)) for channel in record.channels])

    signals.tare(values(played.run, played.run + round(QUIET * record.sample_rate)))
    return signals.of(values(played.start, played.stop))
