"""Sets of devices through `rockbench check`, end to end; `python -m tests.benchmarks.devices` has all of them."""

import os

import pytest

from tests.benchmarks.devices import SETS, checked

pytestmark = pytest.mark.skipif(os.name == "nt", reason="ends the emulated laboratory the POSIX way")


@pytest.mark.soak
@pytest.mark.milliseconds
@pytest.mark.parametrize("chosen", [("PCIe-6351", ()), ("cDAQ-9174", ("9205", "9239", "9269", "9401"))])
def test_a_set_passes_its_check(chosen: tuple[str, tuple[str, ...]]) -> None:
    assert chosen in SETS
    passed, why = checked(*chosen, "analogue")
    assert passed, why
