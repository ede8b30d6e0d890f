"""Sets of devices through `rockbench check`, end to end; `python -m tests.benchmarks.devices` has all of them."""

import os

import pytest

from bench.config.model import BenchConfiguration
from bench.config.review import review
from drivers.emulation.laboratory import Laboratory
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.benchmarks.devices import SETS, checked

pytestmark = pytest.mark.skipif(os.name == "nt", reason="ends the emulated laboratory the POSIX way")


@pytest.mark.soak
@pytest.mark.milliseconds
@pytest.mark.parametrize("chosen", [("PCIe-6351", ()), ("cDAQ-9174", ("9205", "9239", "9269", "9401"))])
def test_a_set_passes_its_check(chosen: tuple[str, tuple[str, ...]]) -> None:
    assert chosen in SETS
    passed, why = checked(*chosen, "analogue")
    assert passed, why


@pytest.mark.parametrize("modules", [("9205", "9263", "9401"), ("9234", "9269", "9401")])
def test_the_sensors_of_a_set_reach_every_limit_of_the_bench(modules: tuple[str, ...]) -> None:
    laboratory = Laboratory(
        VirtualBenchParameters(), Specimen(), seed=1, connection="analogue", device="cDAQ-9174", modules=modules
    )
    with laboratory:
        hardware = laboratory.hardware
    configuration = BenchConfiguration(backend="hardware", hardware=hardware)
    assert not review(configuration).refusals
    # sensitivities are those of a 10 V converter, 100 V/m and 500 ohm, in proportion to the range of the inputs
    span = 5.0 if "9234" in modules else 10.0
    assert hardware.table_displacement.range == span
    assert hardware.table_displacement.sensitivity == pytest.approx(10.0 * span)
    assert hardware.lasers.load == pytest.approx(50.0 * span)
