"""Order, processes and real time of the whole suite."""

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Generator, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from tests.lateness import Lateness
from tests.slowness import Slowness

# a test needs no screen; a person who wants to see the windows sets the variable himself
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# sums of matrix products have the same last digits on every number of processors; read when numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# programs that tests start read compiled modules: without them, each compiles several hundred (a second and more)
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# a result that a test computes with replaced parts must not reach another one
os.environ.setdefault("ROCKBENCH_RESULT_CACHE", "off")
# a window of a test must not attach to the session of another one
os.environ.setdefault("ROCKBENCH_SESSIONS", "off")

pytest.register_assert_rewrite("bench.testing.conformance")

WIRES = (
    "tests/drivers/daqmx/",
    "tests/drivers/emulation/",
    "tests/drivers/optoncdt/",
)
"""Tests of one instrument and its wire, paced by emulated instruments to milliseconds: one after the other, or they
hold each other up."""

RIGS = (
    "tests/drivers/hardware/",
    "tests/drivers/test_hardware_rig.py",
    "tests/faults/emulated/",
    "tests/bench/app/cli/test_devices.py",
    "tests/bench/app/cli/test_emulate.py",
    "tests/protocols/check/",
)
"""The same with all instruments of a rig; beside those of one wire, since both mostly wait."""

PEOPLE = (
    "tests/bench/app/cli/test_interrupts.py",
    "tests/protocols/test_interrupt.py",
    "tests/bench/app/ipc/",
    "tests/bench/app/gui/",
)
"""Tests that a person's clock paces, to tenths of a second: one after the other, beside those of the instruments."""

REAL_TIME = {"rigs": RIGS, "people": PEOPLE, "wires": WIRES}
"""Groups that stay in one process each and mostly wait, the longest first."""

EXCUSES = pytest.StashKey[list[Lateness | Slowness]]()

SPREAD = "tests/faults/test_matrix.py"
"""The longest file of all; its tests share nothing, so they fill every process at the end."""

SLOW = (
    "tests/test_notebooks.py",
    "tests/sim/test_kernel_cache.py",
    "tests/pages/",
    "tests/first_edition/",
    "tests/faults/test_killed.py",
    "tests/bench/app/cli/test_hostile_files.py",
    "tests/bench/app/cli/test_streams.py",
    "tests/bench/replay/",
    "tests/protocols/",
)
"""Files of which many take ten seconds and more: begun early, so that none of them is alone at the end."""


KERNELS = (
    "sim.kernel.members_at_rest",
    "sim.kernel.table, sim.kernel.instruments, sim.kernel.rocking, sim.kernel.equations",
)
"""Modules that compile all of the kernel when they are imported, divided between two processors."""

WINDOW = Path(__file__).parents[1] / "bench" / "app" / "gui" / "__pycache__"
"""Bytecode that is there if all tests were collected before; otherwise each process would compile that of the
libraries, the program and the tests, which takes longer than to import them."""


def pytest_configure(config: pytest.Config) -> None:
    """The kernel, and in a new environment the bytecode, is compiled once, before several processes want it."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", 0) or config.option.collectonly:
        return
    _side_by_side(["-c", f"import {modules}"] for modules in KERNELS)
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS and not WINDOW.exists():
        tests = Path(__file__).parent
        others = [f"--ignore={tests / 'bench'}", str(tests)]
        _side_by_side(["-m", "pytest", "--collect-only", "-q", "-n", "0", *half] for half in (["tests/bench"], others))


def _side_by_side(programs: Iterable[list[str]]) -> None:
    """Carry out Python programs, given by their arguments, at the same time."""
    started = [
        subprocess.Popen([sys.executable, *each], cwd=Path(__file__).parents[1], stdout=subprocess.DEVNULL)
        for each in programs
    ]
    for process in started:
        process.wait()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long tests are left out unless they are asked for."""
    if "soak" in config.option.markexpr:
        return
    long = [item for item in items if item.get_closest_marker("soak")]
    config.hook.pytest_deselected(items=long)
    items[:] = [item for item in items if not item.get_closest_marker("soak")]
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=_turns(items))


def _turns(items: list[pytest.Item]) -> Callable[[pytest.Item], int]:
    """The order in which processes take files: the groups of REAL_TIME, which last longest, then what is slow.

    Each process is given two files at first. The second of one with a group of REAL_TIME begins last of all: it is a
    single test of SPREAD.
    """
    spread = tuple(item.nodeid for item in items if item.nodeid.startswith(SPREAD))
    places = SLOW[:1], spread[: len(REAL_TIME)], SLOW[1:]

    def turn(item: pytest.Item) -> int:
        group = _paced_by(item.nodeid)
        if group is not None:
            return [*REAL_TIME].index(group)
        later = len(places) + item.nodeid.startswith(SPREAD)
        return len(REAL_TIME) + next((n for n, place in enumerate(places) if item.nodeid.startswith(place)), later)

    return turn


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """Nothing of what is imported and collected is garbage: looking for it takes a fifth of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish() -> None:
    """What is there when the first test begins stays until the end: the garbage collector need not look at it."""
    gc.freeze()
    # garbage in cycles is small, and may wait
    gc.set_threshold(20_000, 20, 20)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:  # noqa: ARG001 - the hook's signature
    """Two processes more than processors: those with the tests of REAL_TIME mostly wait."""
    return (os.cpu_count() or 1) + 2


def _paced_by(nodeid: str) -> str | None:
    """The group of REAL_TIME that has a test; None for one that no clock paces."""
    return next((group for group, places in REAL_TIME.items() if nodeid.startswith(places)), None)


_gives_way = False


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Beside others, a process with tests that no clock paces gives way to those with the tests of REAL_TIME."""
    global _gives_way
    beside = "PYTEST_XDIST_WORKER" in os.environ and hasattr(os, "nice")
    if beside and not _gives_way and _paced_by(item.nodeid) is None:
        os.nice(10)
        _gives_way = True


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """A test that claims something about time has the machine measured beside it."""
    with ExitStack() as stack:
        item.stash[EXCUSES] = []
        if item.get_closest_marker("seconds"):
            item.stash[EXCUSES].append(Slowness())
        if item.get_closest_marker("milliseconds"):
            item.stash[EXCUSES].append(stack.enter_context(Lateness()))
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, Any]:
    """Its failure on a machine that does not keep time is a skip, with the figures."""
    report: Any = yield
    if report.failed and report.when == "call":
        for measured in item.stash[EXCUSES]:
            if (excuse := measured.excuse) is not None:
                report.outcome, report.longrepr = "skipped", (str(item.path), 0, excuse)
    return report


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> object:
    """A file stays in one process, so that what its fixtures made is made once; so does each group of REAL_TIME."""
    from xdist.scheduler import LoadScopeScheduling

    # in the order of `_turns`
    config.option.loadscopereorder = False

    class Together(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            if nodeid.startswith(SPREAD):
                return nodeid
            return _paced_by(nodeid) or nodeid.split("::")[0]

    return Together(config, log)


@pytest.fixture
def result_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of a cache of results of the test's own, which it fills."""
    from sim.kernel import compiled

    monkeypatch.delenv("ROCKBENCH_RESULT_CACHE", raising=False)
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path)
    return tmp_path / "results"


@pytest.fixture(scope="module")
def shared_results(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """Planned starts, travels and long-term motions are computed once for all modules with this fixture, whatever the
    process; for modules that replace no part of these calculations.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench.result_cache._folder", lambda: folder / "shared_results")
        yield


@pytest.fixture(scope="module")
def no_figures() -> Generator[None]:
    """For modules that look at no figure of the runs that their commands carry out."""
    from tests.undrawn import undrawn

    with undrawn():
        yield
