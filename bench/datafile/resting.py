"""Rows of a run at rest, from which the zero of its signals was taken."""

from typing import TYPE_CHECKING

import numpy as np

from bench.events import State, StateChanged

if TYPE_CHECKING:
    from bench.datafile.reader import DataFile


def run_starts(record: "DataFile") -> list[float]:
    """Bench time of the first sample of each run [s], from the times of the blocks, which are those of their last
    samples.
    """
    blocks, rows, rate = record.blocks, record.rows, record.sample_rate
    ends = np.append(blocks["row"][1:], rows)
    first = np.flatnonzero(np.diff(blocks["run"], prepend=-1))
    length = ends[first] - blocks["row"][first] + blocks["first"][first]
    return (blocks["time"][first] - length / rate).tolist()


def rows_at_rest(record: "DataFile", begin: int, rest: float) -> slice:
    """The last rows at rest, `rest` seconds at most, of the run whose first row is `begin`; empty if no zero was taken.
    Their mean is the zero of the signals in this run.

    A run begins when the rig is armed. The bench then waits, often for minutes on a real table, until the storeys have
    come to rest; the zero is taken at the end.
    """
    blocks, rate = record.blocks, record.sample_rate
    first = np.flatnonzero(np.diff(blocks["run"], prepend=-1))
    number = int(np.searchsorted(blocks["row"][first], begin))
    last = int(first[number + 1] if number + 1 < first.size else blocks["row"].size) - 1
    start, end_time, half = run_starts(record)[number], float(blocks["time"][last]), 0.5 / rate
    for row in record.entries_of(StateChanged):
        taken = (row["before"], row["after"]) == (State.ARMED, State.RUNNING)
        if taken and start + half < row["time"] <= end_time + half:
            end = begin + round((row["time"] - start) * rate)
            return slice(max(begin, end - round(rest * rate)), end)
    return slice(begin, begin)
