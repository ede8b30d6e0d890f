"""The live twin beside a bench in real time: `python -m tests.benchmarks.twin [SECONDS]`.

A virtual bench shakes a rocking specimen in virtual time; what it acquired is then handed to the twin at the pace of
the clock, as the engine does, for 4 inputs at 2000 samples/s and 6 at 20 000. Printed, each beside its target:

- the processor's time of the twin as a share of one core: that of the same pace without a twin is taken off;
- delay from the last sample of a block to the estimate that was published for it: median, 99 %, longest;
- members at the end (fewer when the machine was too slow), and estimates per block;
- the nominal model's error against `dop853` of scipy under the same accelerations, and what the peer takes for as much:
  a plain loop of `scipy.integrate.solve_ivp` over the same number of specimens, measured with one.
"""

import sys
import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import SignalMap
from bench.comparators.catalogue import solve
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.engine.interface import EventStream, Requests
from bench.events import Acquired, Event, SpecimenMounted, State, StateChanged
from bench.live_values import TwinEstimate
from bench.twin.ensemble import Ensemble, draw_members
from bench.twin.live import live_twin
from drivers.clock import WallClock
from drivers.rig import Alignment, Block, Channel, Counts, OperatorTask
from drivers.simulated import SimulatedRig
from sim.excitation import SampledRecord
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

COUPLED = Specimen().coupled(0.25)
LONGEST_DELAY, LARGEST_SHARE = 0.2, 1.0 / 3.0
REST = 0.5


@dataclass
class Recorded:
    """What a bench acquired, with what else a rig tells of itself; further inputs repeat the first ones."""

    configuration: BenchConfiguration
    channels: tuple[Channel, ...]
    counts: Counts
    clock: WallClock = field(default_factory=WallClock)
    alignments: tuple[Alignment, ...] = ()

    @property
    def sample_rate(self) -> float:
        return self.configuration.sample_rate


def recorded(rate: float, channels: int, seconds: float) -> Recorded:
    """A sine that rocks the block hard and does not topple it, after a rest."""
    configuration = BenchConfiguration(simulation=Simulation(bench=VirtualBenchParameters(sample_rate=rate)))
    t = np.arange(round(seconds * rate)) / rate
    volts = 1.3 * np.clip((t - REST) / 2.0, 0.0, 1.0) * np.sin(22.0 * t)
    with SimulatedRig(configuration.simulation.bench, COUPLED, seed=1) as rig:
        rig.arm()
        rig.write(np.concatenate((np.zeros(rig.lead), volts)))
        counts = rig.read(t.size).counts
        more = channels - len(rig.channels)
        names = [channel.name for channel in rig.channels]
        further = tuple(
            Channel(f"further_{k}", one.quantity, one.unit, one.scale, one.offset, one.valid, one.device)
            for k, one in enumerate(rig.channels[:more])
        )
        assert len(names) + more == channels
        return Recorded(configuration, (*rig.channels, *further), np.hstack((counts, counts[:, :more])))


@dataclass
class Paced:
    """How one pass through a recording went: processor's time [s], and the delay of every estimate [s]."""

    processor: float
    delays: NDArray[np.float64]
    blocks: int
    members: int


def paced(bench: Recorded, enabled: bool) -> Paced:
    """Hand the blocks over when they would have been read."""
    rate, size = bench.sample_rate, bench.configuration.block_samples
    twin = bench.configuration.twin.model_copy(update={"enabled": enabled})
    configuration = bench.configuration.model_copy(update={"twin": twin})
    due: dict[float, float] = {}
    delays: list[float] = []
    members: list[int] = []

    def hear(event: Event) -> None:
        if isinstance(event, TwinEstimate):
            delays.append(time.perf_counter() - due[event.time])
            members.append(event.members)

    stream = EventStream(bench.clock, [hear])
    signals = SignalMap(bench.channels, configuration.laser_reference)
    rest = bench.counts[: round(REST * rate)]
    signals.tare(np.column_stack([each.to_unit(rest[:, k]) for k, each in enumerate(bench.channels)]))
    every = signals.of(np.column_stack([each.to_unit(bench.counts[:, k]) for k, each in enumerate(bench.channels)]))
    with live_twin(stream, bench, configuration, Requests(), patient=False):  # type: ignore[arg-type]
        stream.publish(SpecimenMounted(COUPLED, OperatorTask.MOUNT_SPRING, time=0.0))
        time.sleep(2.0)
        stream.publish(StateChanged(State.ARMED, State.RUNNING, "at rest, zero taken", time=0.0))
        begin, before = time.perf_counter(), time.process_time()
        for number, first in enumerate(range(0, len(bench.counts) - size + 1, size)):
            moment = begin + (first + size) / rate
            time.sleep(max(moment - time.perf_counter(), 0.0))
            due[float(number)] = moment
            block = Block(first, bench.counts[first : first + size])
            shown = every[first : first + size]
            stream.publish(Acquired(1, block, np.zeros(size), shown, time=float(number)))
        processor = time.process_time() - before
    return Paced(processor, np.array(delays), len(due), members[-1] if members else 0)


def against_scipy(bench: Recorded, seconds: float = 3.0) -> tuple[float, float, float]:
    """Largest error of the nominal model's drift over its peak, and the processor's time of all members and of the
    peer's loop for one second of the test [s].
    """
    dt, column = 1e-3, [channel.name for channel in bench.channels].index("table_acceleration")
    every = round(dt * bench.sample_rate)
    values = bench.channels[column].to_unit(bench.counts[:, column])
    values = values[: round(seconds * bench.sample_rate)].reshape(-1, every).mean(axis=1)
    those = draw_members(COUPLED, bench.configuration)
    ensemble, before = Ensemble(those, dt), time.process_time()
    motions = np.concatenate([ensemble.feed(part) for part in np.split(values, len(values) // 100)], axis=2)
    ours = time.process_time() - before
    record = SampledRecord(np.concatenate(([0.0], values)), dt)
    before = time.process_time()
    found = solve("dop853", COUPLED, record, sample_times=dt * np.arange(1, len(values) + 1), peaks_from=None).samples
    peer = len(those.specimens) * (time.process_time() - before)
    assert found is not None
    expected = found[:, 1] - found[:, 0]
    error = float(np.abs(motions[1, 0] - motions[0, 0] - expected).max() / np.abs(expected).max())
    return error, ours / seconds, peer / seconds


def main(seconds: float) -> None:
    """Measure and print."""
    for rate, channels in ((2000.0, 4), (20_000.0, 6)):
        bench = recorded(rate, channels, seconds)
        without, beside = paced(bench, enabled=False), paced(bench, enabled=True)
        share = (beside.processor - without.processor) / seconds
        asked = bench.configuration.twin.members
        print(
            f"\n{channels} inputs at {rate:g} samples/s, blocks of {bench.configuration.acquisition.block_duration:g} s"
        )
        print(f"  members             {beside.members} of {asked}")
        print(f"  estimates           {beside.delays.size} for {beside.blocks} blocks")
        print(f"  processor           {share:.1%} of a core (target {LARGEST_SHARE:.0%})")
        median, most = np.percentile(beside.delays, [50, 99])
        print(
            f"  delay               {1e3 * median:.0f} ms, 99 %: {1e3 * most:.0f} ms, longest"
            f" {1e3 * beside.delays.max():.0f} ms (target {1e3 * LONGEST_DELAY:.0f} ms)"
        )
    error, ours, peer = against_scipy(bench)
    print(f"\n  error against dop853   {error:.1e} of the peak drift over 3 s of rocking")
    print(f"  all models             {ours:.3f} s of a core for one second of the test")
    print(f"  the peer's loop        {peer:.1f} s, {peer / ours:.0f} times as much")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
