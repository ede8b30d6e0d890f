"""Opens the rig that a configuration asks for."""

from bench.config.model import BenchConfiguration
from drivers.clock import VirtualClock, WallClock
from drivers.rig import Rig


def open_rig(configuration: BenchConfiguration, *, realtime: bool) -> Rig:
    """The configured backend, stopped. The caller closes it."""
    from drivers.simulated import SimulatedRig

    simulation = configuration.simulation
    return SimulatedRig(
        simulation.bench,
        simulation.specimen or configuration.specimen,
        seed=simulation.seed,
        spring_factor=simulation.spring_factor,
        clock=WallClock() if realtime else VirtualClock(),
        lead=block_samples(configuration),
    )


def block_samples(configuration: BenchConfiguration) -> int:
    """Samples in one turn of the acquisition loop."""
    return max(round(configuration.acquisition.block_duration * configuration.simulation.bench.sample_rate), 1)
