"""Lasers aligned by pulses of a counter, on the emulated laboratory, against its truth."""

import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from drivers.daqmx.parameters import AUTOMATIC
from drivers.emulation.laboratory import Laboratory
from drivers.errors import RigError, SafetyInputOpen
from drivers.hardware.parameters import Hardware
from drivers.hardware.rig import HardwareRig
from drivers.rig import Alignment, Block
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.patience import LONG

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="emulated serial lasers need pseudo-terminals"),
    pytest.mark.milliseconds,
]

LEAD, BLOCK = 2000, 200
HARDLY = 0.2
"""How long the lasers are observed [s] where it is no matter how well their clocks are known."""


@pytest.fixture(scope="module")
def laboratory() -> Iterator[Laboratory]:
    with Laboratory(VirtualBenchParameters(), Specimen(), seed=1) as emulated:
        yield emulated


def marked_by(laboratory: Laboratory, counter: str, observed: float = 1.0) -> Hardware:
    hardware = laboratory.hardware
    daq = hardware.daq.model_copy(update={"laser_marker": counter})
    return hardware.model_copy(
        update={"daq": daq, "lasers": hardware.lasers.model_copy(update={"observation_time": observed, "delay": 0.0})}
    )


def started(rig: HardwareRig) -> None:
    rig.arm()
    rig.write(np.zeros(LEAD))


@dataclass(frozen=True)
class Run:
    """First block and alignments of a run, with the instant of its first sample [s]; `pulsed`: whether the lasers were
    switched after it.
    """

    block: Block
    alignments: tuple[Alignment, ...]
    zero: float
    pulsed: bool


@dataclass(frozen=True)
class Runs:
    """Two runs of one rig: the first after pulses of one second, the second after two seconds more."""

    laboratory: Laboratory
    rig: HardwareRig
    first: Run
    second: Run
    pulsed_at_last: bool


def run(rig: HardwareRig, laboratory: Laboratory) -> Run:
    started(rig)
    block, alignments = rig.read(BLOCK), rig.alignments
    assert laboratory.daq.first_sample is not None
    zero = laboratory.daq.first_sample + rig.skipped / laboratory.bench.rate_true
    rig.stop()
    return Run(block, alignments, zero, laboratory.lasers[0].switching)


@pytest.fixture(scope="module")
def runs(laboratory: Laboratory) -> Runs:
    with HardwareRig(marked_by(laboratory, AUTOMATIC), lead=LEAD - BLOCK) as rig:
        first = run(rig, laboratory)
        rig.clock.wait_until(rig.clock.now() + 2.0)
        second = run(rig, laboratory)
    return Runs(laboratory, rig, first, second, laboratory.lasers[0].switching)


def test_the_lasers_are_aligned_at_arming(runs: Runs) -> None:
    laboratory, rig, armed = runs.laboratory, runs.rig, runs.first
    assert armed.block.first == 0
    clock = laboratory.bench.rate_true / rig.sample_rate
    for one, laser in zip(armed.alignments, laboratory.lasers, strict=True):
        assert one.mark_uncertainty < 10e-6
        # at the middle of the pulses, where the rates of the clocks have the least effect
        middle = -0.5 * rig.skipped / rig.sample_rate
        sensor = (armed.zero + middle / clock - laser.epoch) * laser.rate_true / 4000.0 - laser.stamp_lag
        assert abs(one.offset + one.rate * sensor - middle) < 20e-6
    names = [channel.name for channel in rig.channels]
    # the pulses have ended before the first sample
    for name in ("laser_1", "laser_2"):
        column = names.index(name)
        assert not np.isnan(rig.channels[column].to_unit(armed.block.counts[:, column])).all()


def test_a_safety_input_that_opens_during_the_pulses_ends_the_run() -> None:
    with (
        Laboratory(VirtualBenchParameters(), Specimen(), seed=1) as laboratory,
        HardwareRig(marked_by(laboratory, AUTOMATIC, HARDLY), lead=LEAD - BLOCK) as rig,
    ):
        started(rig)
        laboratory.safety.break_wire("emergency_stop")
        with pytest.raises(SafetyInputOpen, match="emergency stop opened before the first sample"):
            rig.read(BLOCK)
        assert not laboratory.bench.enabled


def test_pulses_between_the_runs_give_the_rates(runs: Runs) -> None:
    """Pulses for one second, then for three; the arrivals give the rates to some 10 ppm in the first block."""
    for done, largest in ((runs.first, 30e-6), (runs.second, 5e-6)):
        for one, laser in zip(done.alignments, runs.laboratory.lasers, strict=True):
            true = (runs.laboratory.bench.rate_true / runs.rig.sample_rate) * 4000.0 / laser.rate_true
            assert abs(one.rate - true) < largest
        assert done.pulsed
    # closing the rig ends the pulses
    assert not runs.pulsed_at_last


def test_lasers_that_do_not_follow_are_named(laboratory: Laboratory) -> None:
    with HardwareRig(marked_by(laboratory, "Dev1/ctr1", HARDLY), lead=LEAD - BLOCK) as rig:
        started(rig)
        with pytest.raises(RigError, match="laser_1 and laser_2 did not follow the pulses"):
            rig.read(BLOCK)
        assert not laboratory.bench.enabled


def test_the_counter_never_waits_for_a_laser(laboratory: Laboratory) -> None:
    """The thread of a laser's line waits for the bench, whose locks the device holds while it starts its tasks."""
    (laser, _) = laboratory.lasers
    with laser._lock:  # pyright: ignore[reportPrivateUsage]
        switched = threading.Thread(target=laser.switch, args=(np.zeros(0),), daemon=True)
        switched.start()
        switched.join(LONG)
        assert not switched.is_alive()
