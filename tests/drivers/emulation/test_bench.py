"""The emulated bench under a clock of the test: what hands did reaches its lasers in time."""

from types import SimpleNamespace

import numpy as np
import pytest

from drivers.emulation import bench as module
from drivers.emulation.bench import EmulatedBench
from drivers.errors import RigError
from drivers.rig import OperatorTask
from sim.block_face import rotation
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters


class Hour:
    """A monotonic clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def hour() -> Hour:
    return Hour()


@pytest.fixture
def bench(hour: Hour, monkeypatch: pytest.MonkeyPatch) -> EmulatedBench:
    """Not started: it moves when it is looked at."""
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=hour.monotonic))
    return EmulatedBench(VirtualBenchParameters(), Specimen(), seed=2)


def test_both_outputs_of_laser_2_see_the_tilted_block_and_its_release(bench: EmulatedBench, hour: Hour) -> None:
    for work, amount in (
        (OperatorTask.LOCK_TABLE, None),
        (OperatorTask.WATCH_BLOCK, 0.3),
        (OperatorTask.TILT_BLOCK, -0.07),
    ):
        bench.perform(work, amount)
    hour.now += 10.0
    bench.enable(True)
    enabled = hour.now
    hour.now += 8.0
    times = enabled + np.linspace(-8.0, 7.9, 4000)
    serial = rotation(bench.target_displacement(2, times), 0.3, bench.specimen.block)
    before, after = serial[times < enabled + 3.0], serial[times > enabled + 5.5]
    np.testing.assert_allclose(before, -0.07, atol=1e-15)
    assert after.max() > 0.03
    assert not bench.fallen
    ticks = np.round((times - 100.0) * bench.rate_true).astype(int)
    first = int(ticks[0])
    analogue = bench.channels[3].to_unit(bench.inputs(first, int(ticks[-1]) - first)[:, 3])
    seen = rotation(analogue[ticks[:-1] - first], 0.3, bench.specimen.block)
    # latency and filter delay the analogue output by 5 ms, at 0.6 rad/s or less; linearity 0.16 mm over 300 mm
    np.testing.assert_allclose(seen, serial[:-1], atol=5e-3)


def test_a_hand_holds_on_while_the_amplifier_does_not_listen(bench: EmulatedBench, hour: Hour) -> None:
    bench.perform(OperatorTask.PULL_FRAME, 0.01)
    for _ in range(2):
        bench.enable(True)
        hour.now += 2.9
        bench.enable(True)
        bench.enable(False)
        hour.now += 20.0
        assert bench.target_displacement(2, np.array([hour.now - 0.01]))[0] == pytest.approx(0.01, abs=1e-5)
    bench.enable(True)
    hour.now += 5.1
    bench.inputs(bench.tick() - 1, 1)
    hour.now += 3.0
    assert bench.target_displacement(2, hour.now - np.linspace(3.0, 0.0, 500)).min() < -0.008


def test_a_block_that_was_taken_away_is_no_target(bench: EmulatedBench, hour: Hour) -> None:
    bench.perform(OperatorTask.WATCH_BLOCK, 0.3)
    bench.perform(OperatorTask.REMOVE_BLOCK, None)
    hour.now += 1.0
    assert np.isnan(bench.target_displacement(2, np.array([hour.now - 0.1]))).all()
    assert np.isfinite(bench.target_displacement(1, np.array([hour.now - 0.1]))).all()


def test_hands_stay_off_while_the_amplifier_listens(bench: EmulatedBench) -> None:
    bench.enable(True)
    with pytest.raises(RigError, match="tilt block is refused: the amplifier is enabled"):
        bench.perform(OperatorTask.TILT_BLOCK, 0.05)
