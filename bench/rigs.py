"""Opens the rig that a configuration asks for."""

from bench.config.model import BenchConfiguration
from drivers.clock import VirtualClock, WallClock
from drivers.rig import Rig
from sim.extras import require


def require_drivers(configuration: BenchConfiguration) -> None:
    """Check that the libraries of the configured backend are installed. Raises MissingExtra."""
    if configuration.backend == "hardware":
        require("ni", "the hardware backend")
        if configuration.hardware.lasers.connection == "serial":
            require("serial", "a laser on a serial port")


def open_rig(configuration: BenchConfiguration, *, realtime: bool) -> Rig:
    """The configured backend, stopped; the hardware is always in real time. The caller closes it."""
    if configuration.backend == "hardware":
        from drivers.hardware.rig import HardwareRig

        return HardwareRig(configuration.hardware, lead=configuration.lead_samples, further=configuration.channels)
    from drivers.simulated import SimulatedRig

    simulation = configuration.simulation
    return SimulatedRig(
        simulation.bench,
        simulation.specimen or configuration.specimen,
        seed=simulation.seed,
        spring_factor=simulation.spring_factor,
        clock=WallClock() if realtime else VirtualClock(),
        lead=configuration.lead_samples,
        further=configuration.channels,
    )
