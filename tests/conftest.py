"""What every test shares."""

import os
from typing import Any

import pytest

# a test needs no screen; a person who wants to see the windows sets the variable himself
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# sums of matrix products have the same last digits on every number of processors; read when numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

REAL_TIME = (
    "tests/drivers/daqmx/",
    "tests/drivers/emulation/",
    "tests/drivers/hardware/",
    "tests/drivers/optoncdt/",
    "tests/drivers/test_hardware_rig.py",
    "tests/faults/emulated/",
    "tests/bench/test_devices.py",
    "tests/bench/test_emulate.py",
    "tests/bench/test_interrupts.py",
    "tests/protocols/test_interrupt.py",
    "tests/protocols/check/",
    "tests/link/",
    "tests/gui/",
)
"""Tests that emulated instruments or a person's clock pace: one after the other, or they hold each other up."""


SPREAD = "tests/faults/test_matrix.py"
"""The longest file of all; its tests share nothing, so they fill every process at the end."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long tests are left out unless they are asked for."""
    if "soak" in config.option.markexpr:
        return
    long = [item for item in items if item.get_closest_marker("soak")]
    config.hook.pytest_deselected(items=long)
    items[:] = [item for item in items if not item.get_closest_marker("soak")]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:  # noqa: ARG001 - the hook's signature
    """One process more than processors: the one with the tests of REAL_TIME mostly waits."""
    return (os.cpu_count() or 1) + 1


_gives_way = False


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Beside others, a process with tests that no clock paces gives way to the one with those of REAL_TIME."""
    global _gives_way
    beside = "PYTEST_XDIST_WORKER" in os.environ and hasattr(os, "nice")
    if beside and not _gives_way and not item.nodeid.startswith(REAL_TIME):
        os.nice(10)
        _gives_way = True


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> object:
    """A file stays in one process, so that what its fixtures made is made once; all of REAL_TIME stays in one too."""
    from xdist.scheduler import LoadScopeScheduling

    class Together(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            if nodeid.startswith(SPREAD):
                return nodeid
            return "real time" if nodeid.startswith(REAL_TIME) else nodeid.split("::")[0]

    return Together(config, log)
