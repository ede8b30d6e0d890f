"""Parallel application of a function to many items, on this computer or through a dask.distributed scheduler."""

import os
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import contextmanager
from importlib import import_module
from time import sleep
from typing import Any, TypeVar

from sim.errors import InvalidInput, RockbenchError
from sim.extras import require
from sim.waiting import STEP

Item = TypeVar("Item")
Result = TypeVar("Result")

PATIENCE = 10.0
"""Time-out for the response of a scheduler [s]."""

Done = Callable[[int, int], None]
"""Function called with the number of completed items, or of tasks sent to a scheduler, and their total."""


class SchedulerUnavailable(RockbenchError):
    """Error: the scheduler does not respond."""

    error_code = "scheduler_unavailable"


def processors(scheduler: str | None = None) -> int:
    """Number of processors for a sweep: those of this computer, or the threads of all workers of a `scheduler`.

    While the scheduler has no workers, this is the number of processors of this computer. Raises the errors of `sweep`
    that concern the scheduler.
    """
    here = os.cpu_count() or 1
    if scheduler is None:
        return here
    with _connected(scheduler) as client:
        return sum(client.nthreads().values()) or here


def sweep(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    scheduler: str | None = None,
    *,
    batch: int = 1,
    done: Done | None = None,
) -> list[Result]:
    """Apply `function` to each item and return the results in order. Raises the first exception in `function`.

    By default, the function runs in as many threads as there are processors (see `in_threads`). With the address of a
    dask `scheduler`, such as "tcp://10.0.0.5:8786", it runs in the workers of the scheduler, which need this package;
    function and items must be picklable. There, a task has `batch` items, and `done` counts tasks. Choose `batch` so
    that a task takes much longer than the few milliseconds of its transfer.

    Raises InvalidInput for batch < 1, MissingExtra without the extra "distributed", and SchedulerUnavailable if the
    scheduler does not respond.
    """
    if batch < 1:
        raise InvalidInput("batch", batch, "a task must have at least one item")
    todo = list(items)
    if scheduler is not None:
        return _distributed(function, todo, scheduler, batch, done)
    return in_threads(function, todo, done)


def in_threads(
    function: Callable[[Item], Result], items: Iterable[Item], done: Done | None = None, *, threads: int | None = None
) -> list[Result]:
    """Apply `function` to each item in `threads`, by default as many as there are processors, and return the results in
    order. `done` is called in the calling thread.

    Threads are suitable for work in `sim.kernel`, which releases the interpreter lock. The first exception in
    `function` is raised in the calling thread, as is KeyboardInterrupt; then no further item is started, and there is
    no wait for items in progress.
    """
    pool = ThreadPoolExecutor(threads or processors())
    try:
        futures = [pool.submit(function, item) for item in items]
        waiting: set[Future[Result]] = set(futures)
        while waiting:
            finished, waiting = wait_for(waiting, STEP, FIRST_EXCEPTION)
            for future in finished:
                future.result()
            if done is not None:
                done(len(futures) - len(waiting), len(futures))
        return [future.result() for future in futures]
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _distributed(
    function: Callable[[Item], Result], items: list[Item], scheduler: str, batch: int, done: Done | None
) -> list[Result]:
    with _connected(scheduler) as client:
        # pure=False, so that a result of an earlier sweep is not reused
        groups = [items[i : i + batch] for i in range(0, len(items), batch)]
        futures: Any = client.map(_each, groups, function=function, pure=False)
        while not all(future.done() for future in futures):
            if done is not None:
                done(sum(future.done() for future in futures), len(futures))
            sleep(STEP)
        gathered: list[list[Result]] = client.gather(futures)
    return [result for group in gathered for result in group]


_kept: dict[str, Any] = {}
"""Open connections by the address of their scheduler."""


@contextmanager
def connection(scheduler: str | None) -> Generator[None, None, None]:
    """Context manager that keeps the connection to a `scheduler` open for several sweeps; no effect for None."""
    if scheduler is None or scheduler in _kept:
        yield
        return
    with _connected(scheduler) as client:
        _kept[scheduler] = client
        try:
            yield
        finally:
            del _kept[scheduler]


@contextmanager
def _connected(scheduler: str) -> Generator[Any, None, None]:
    if scheduler in _kept:
        yield _kept[scheduler]
        return
    require("distributed", f"scheduler = {scheduler!r}")
    # `Any`, because this is an optional dependency without type annotations
    distributed: Any = import_module("distributed")
    try:
        client: Any = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SchedulerUnavailable(
            f"scheduler = {scheduler!r} does not respond ({error}): start it, or specify the address that it prints"
        ) from error
    with client:
        yield client


def _each(group: list[Item], function: Callable[[Item], Result]) -> list[Result]:
    return [function(item) for item in group]
