"""A signal that breaks off a computation frees none of its objects, which native code may hold half handed over."""

import signal
import sys
from collections.abc import Callable, Generator
from typing import Any, cast

import numba
import pytest
from numba.core.registry import cpu_target

from bench import unfinished
from bench.app.cli.interrupt import Interrupts, interruptible
from bench.app.ipc.process import _abort_on_terminate  # pyright: ignore[reportPrivateUsage]
from bench.engine.interface import Requests

if sys.platform == "win32":
    pytest.skip("raises SIGINT and SIGTERM in this process", allow_module_level=True)


class Module:
    """Native memory that is freed when the object goes."""

    freed = 0

    def __del__(self) -> None:
        Module.freed += 1


@pytest.fixture(autouse=True)
def handlers() -> Generator[None]:
    """Restores the handlers, and frees what was kept."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    Module.freed = 0
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
    _free()


def _free() -> None:
    unfinished._broken_off.clear()  # pyright: ignore[reportPrivateUsage]


def _command() -> None:
    signal.signal(signal.SIGINT, Interrupts())
    _linked(signal.SIGINT)


def _planned_run() -> None:
    requests = Requests()
    with interruptible(requests, lambda: False), requests.without_rig():
        _linked(signal.SIGINT)


def _run_of_the_window() -> None:
    requests = Requests()
    _abort_on_terminate(requests)
    with requests.without_rig():
        _linked(signal.SIGTERM)


def _linked(number: signal.Signals) -> None:
    """Two objects, one held by each of two calls."""
    first = Module()

    def link() -> None:
        second = Module()
        signal.raise_signal(number)
        pytest.fail(f"{number} was not handled with {first} and {second}")

    link()


@pytest.mark.parametrize("computation", [_command, _planned_run, _run_of_the_window])
def test_the_objects_are_kept_until_the_process_ends(computation: Callable[[], None]) -> None:
    interrupted = False
    try:
        computation()
    except KeyboardInterrupt:
        interrupted = True
    assert interrupted
    assert Module.freed == 0
    _free()
    assert Module.freed == 2


@pytest.mark.parametrize("asked", ["_object_cache_getbuffer", "_object_cache_notify"])
def test_the_code_that_llvm_asks_for_is_still_handed_over(asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a kernel would be loaded without its functions, and the process would end by a segmentation fault."""
    engine = cast(Any, cpu_target).target_context.codegen()._engine._ee
    answer, interrupts = getattr(engine, asked), Interrupts()

    def interrupted(*arguments: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return answer(*arguments)

    monkeypatch.setattr(engine, asked, interrupted)
    signal.signal(signal.SIGINT, interrupts)
    assert cast(Any, numba).njit(lambda x: 2.0 * x)(3.0) == 6.0  # pyright: ignore[reportUnknownLambdaType]
    assert interrupts.first == signal.SIGINT
