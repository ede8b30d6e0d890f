"""How run times are taken: the first call apart, then the contenders in turn, so that a busy machine is fair to all."""

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any, Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Timing(Generic[T]):
    """Times [s] of repeated runs, and what the last one gave."""

    minimum: float
    median: float
    result: T


def once(run: Callable[[], T]) -> tuple[float, T]:
    """Time [s] and result of one run."""
    begin = time.perf_counter()
    result = run()
    return time.perf_counter() - begin, result


def timed(run: Callable[[], T], repetitions: int) -> Timing[T]:
    """Times of `repetitions` runs after one that does not count."""
    run()
    return in_turn({"": (run, repetitions)})[""]


def in_turn(runs: Mapping[str, tuple[Callable[[], Any], int]]) -> dict[str, Timing[Any]]:
    """Times of several runs, each with its number of repetitions, spread evenly over the rounds.

    The garbage collector waits meanwhile.
    """
    times: dict[str, list[float]] = {name: [] for name in runs}
    results: dict[str, Any] = {}
    collecting = gc.isenabled()
    gc.disable()
    try:
        rounds = max(count for _, count in runs.values())
        for turn in range(rounds):
            for name, (run, count) in runs.items():
                if (turn + 1) * count // rounds > turn * count // rounds:
                    elapsed, results[name] = once(run)
                    times[name].append(elapsed)
    finally:
        if collecting:
            gc.enable()
    return {name: Timing(min(times[name]), median(times[name]), results[name]) for name in runs}
