"""The rig backends of this program, and a function that opens the configured rig."""

from bench.config.backend import CommonSettings, RigBackend, load_backend
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from drivers.border import CheckedRig
from drivers.clock import VirtualClock, WallClock
from drivers.errors import BackendFault
from drivers.hardware.parameters import Hardware
from drivers.rig import Rig
from sim.errors import RockbenchError
from sim.extras import require

_PURPOSES = {"serial": "a laser on a serial port"}
"""Purpose of each optional dependency (extra) that not every bench requires, as named in the error message."""


def require_drivers(configuration: BenchConfiguration) -> None:
    """Check that the libraries of the configured backend are installed. Raises MissingExtra."""
    for extra in load_backend(configuration.backend).extras(configuration.settings):
        require(extra, _PURPOSES.get(extra, f"the {configuration.backend} backend"))


def open_rig(configuration: BenchConfiguration, *, realtime: bool) -> Rig:
    """Open the rig of the configured backend, unarmed and wrapped in the checks of `drivers.border`. The caller closes
    it.

    Raises BackendFault if the backend raises an error that is not a RockbenchError, or returns an invalid rig.
    """
    backend = load_backend(configuration.backend)
    try:
        rig = backend.open(configuration, configuration.settings, realtime or backend.real_time_only)
    except (RockbenchError, MemoryError):
        raise
    except Exception as error:
        what = f"failed while opening ({type(error).__name__}: {' '.join(str(error).split())})"
        raise BackendFault(configuration.backend, what) from error
    return CheckedRig(rig, configuration.backend)


def _open_simulated(configuration: CommonSettings, settings: Simulation, realtime: bool) -> Rig:
    from drivers.simulated import SimulatedRig

    return SimulatedRig(
        settings.bench,
        settings.specimen or configuration.specimen,
        seed=settings.seed,
        spring_factor=settings.spring_factor,
        clock=WallClock() if realtime else VirtualClock(),
        lead=configuration.lead_samples,
        further=configuration.channels,
    )


def _open_hardware(configuration: CommonSettings, settings: Hardware, _realtime: bool) -> Rig:
    from drivers.hardware.rig import HardwareRig

    return HardwareRig(settings, lead=configuration.lead_samples, further=configuration.channels)


def _hardware_extras(settings: Hardware) -> tuple[str, ...]:
    return ("ni", "serial") if settings.lasers.connection == "serial" else ("ni",)


SIMULATED = RigBackend(_open_simulated, Simulation, real_time_only=False, operator=False)
HARDWARE = RigBackend(_open_hardware, Hardware, _hardware_extras)
