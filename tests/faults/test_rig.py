"""The rig that faults are put into is a rig, and without a fault it is the one that it wraps."""

import inspect
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bench.testing.conformance import RigConformance, RigFactory
from drivers.rig import Rig
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.faults.audit import judge
from tests.faults.bench import FaultyBench, run
from tests.faults.catalogue import catalogue
from tests.faults.fault import Fault, never
from tests.faults.places import PLACES
from tests.faults.rig import FaultyRig

SURFACE = [name for name in vars(Rig) if not name.startswith("_")]


@pytest.mark.parametrize("name", SURFACE)
def test_the_surface_is_that_of_every_rig(name: str) -> None:
    asked, given = vars(Rig)[name], vars(FaultyRig)[name]
    if isinstance(asked, property):
        assert isinstance(given, property)
        asked, given = asked.fget, given.fget
    assert inspect.signature(given) == inspect.signature(asked)


class TestWithoutFaults(RigConformance):
    @pytest.fixture
    def make_rig(self) -> Iterator[RigFactory]:
        rigs: list[FaultyRig] = []

        def make() -> Rig:
            parameters = VirtualBenchParameters(sample_rate=1000.0)
            rigs.append(FaultyRig(SimulatedRig(parameters, Specimen(), seed=1)))
            return rigs[-1]

        yield make
        for rig in rigs:
            rig.close()


def test_without_a_fault_two_tests_are_carried_out() -> None:
    bench = FaultyBench(None)
    story = run(bench)
    assert (story.status, bench.rig.cuts, story.armed) == ("completed", 0, False)
    assert [float(np.abs(one.drive).max()) > 0.5 for one in bench.rig.runs] == [True, True]


@pytest.mark.parametrize("lie", ["not noticed", "noticed where", "ended as", "raised"])
def test_the_audit_finds_what_is_not_as_it_should_be(lie: str, tmp_path: Path) -> None:
    """Each rule of the ending is broken once, by a fault that is not what it says."""
    known = {fault.name: fault for fault in catalogue()}
    spike, abort = known["spike on laser_1"], known["abort asked for"]
    false = {
        "not noticed": Fault("lie", spike.begin, "aborted", "laser_1", abort.must),
        "noticed where": Fault("lie", abort.begin, "aborted", "abort requested", never),
        "ended as": Fault("lie", abort.begin, "stopped", "abort requested", abort.must),
        "raised": Fault("lie", abort.begin, "failed", "abort requested", abort.must, raises=OSError),
    }[lie]
    place = next(place for place in PLACES if place.name == "dwelling")
    verdict = judge(false, place, tmp_path)
    assert any(lie in broken for broken in verdict.broken)
