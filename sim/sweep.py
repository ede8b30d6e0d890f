"""One function over many items: on this machine's processors, or on those of a dask.distributed scheduler."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from typing import Any, TypeVar

from sim.errors import InvalidInput, RockbenchError
from sim.extras import require

Item = TypeVar("Item")
Result = TypeVar("Result")

PATIENCE = 10.0
"""Seconds to wait for a scheduler to answer."""


class SchedulerUnavailable(RockbenchError):
    """The work cannot go to a scheduler: nothing answers there."""


def processors() -> int:
    """Processors that this machine has for a sweep."""
    return os.cpu_count() or 1


def sweep(
    function: Callable[[Item], Result], items: Iterable[Item], scheduler: str | None = None, *, batch: int = 1
) -> list[Result]:
    """`function` of each item, in order; the first exception that it raises is raised here.

    By default in as many threads as there are processors: right for work that goes on in `sim.kernel`, which lets
    other threads run. With the address of a dask `scheduler`, such as "tcp://10.0.0.5:8786", its workers do it; they
    need this package, and function and items must be picklable. A task there carries `batch` items: make it last long
    against the milliseconds that its journey takes.

    Raises InvalidInput for batch < 1, MissingExtra without the extra "distributed", SchedulerUnavailable when nothing
    answers.
    """
    if batch < 1:
        raise InvalidInput("batch", batch, "a task carries at least one item")
    todo = list(items)
    if scheduler is not None:
        return _distributed(function, todo, scheduler, batch)
    with ThreadPoolExecutor(processors()) as pool:
        return list(pool.map(function, todo))


def _distributed(function: Callable[[Item], Result], items: list[Item], scheduler: str, batch: int) -> list[Result]:
    require("distributed", f"scheduler = {scheduler!r}")
    # `Any`: an optional dependency, which publishes no types
    distributed: Any = import_module("distributed")
    try:
        client: Any = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SchedulerUnavailable(
            f"scheduler = {scheduler!r} does not answer ({error}): start it, or give the address that it prints"
        ) from error
    with client:
        # items are the same function's: equal ones may share a result, but never one of an earlier sweep
        groups = [items[i : i + batch] for i in range(0, len(items), batch)]
        futures: Any = client.map(_each, groups, function=function, pure=False)
        gathered: list[list[Result]] = client.gather(futures)
    return [result for group in gathered for result in group]


def _each(group: list[Item], function: Callable[[Item], Result]) -> list[Result]:
    return [function(item) for item in group]
