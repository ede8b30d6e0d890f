"""Rig backends, registered as entry points by this program and by other packages."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal
from typing import Protocol as Interface

from bench.plugins import load_plugin, plugin_names
from sim.parameters import Parameters, quantity

if TYPE_CHECKING:
    from drivers.further import FurtherChannel
    from drivers.rig import Rig
    from sim.specimen import Specimen

RIGS = "rockbench.rigs"
"""Group of the entry points of rig backends."""


class RigSettings(Parameters):
    """Table `[rig]` of a configuration: settings of a bench whose backend belongs to another package.

    A backend derives its settings class from this one, adds its own keys and may change defaults.
    """

    sample_rate: float = quantity(1000.0, "1/s", "samples per second of drive and inputs", gt=0, le=20_000)
    drive_range: float = quantity(10.0, "V", "largest magnitude of the drive", gt=0, le=100)
    acceleration_range: float | None = quantity(
        None,
        "m/s2",
        "measuring range of the accelerometer; if absent, no limit is checked against it",
        gt=0,
        example=100.0,
    )
    half_stroke: float = quantity(0.075, "m", "distance from mid stroke to each end stop", gt=0)
    band_low: float = quantity(1.0, "Hz", "lower end of the table's usable band", gt=0)
    band_high: float = quantity(100.0, "Hz", "upper end of the table's usable band", gt=0)
    moving_mass: float | None = quantity(
        None,
        "kg",
        "mass of armature, table and fixtures, used to estimate force and current; if absent, they are not estimated",
        gt=0,
        usual=(2.0, 500.0),
        example=50.0,
    )
    force_constant: float | None = quantity(
        None,
        "N/A",
        "force per ampere of the coil, used to estimate its current; if absent, force and current are not estimated",
        gt=0,
        usual=(5.0, 200.0),
        example=50.0,
    )
    laser_reference: Literal["ground", "table"] = quantity(
        "ground", "", "mounting of the lasers: on the ground they measure x + u, on the table u (x: table, u: storey)"
    )
    laser_1_range: float = quantity(0.2, "m", "measuring range of the laser on the first storey", gt=0)
    laser_2_range: float = quantity(0.2, "m", "measuring range of the laser on the second storey", gt=0)

    @property
    def laser_ranges(self) -> tuple[float, float]:
        """Measuring ranges of the lasers on the first and the second storey [m]."""
        return self.laser_1_range, self.laser_2_range

    @property
    def suspension(self) -> float:
        """Stiffness between table and ground [N/m], used to estimate the force."""
        return 0.0


class CommonSettings(Interface):
    """Part of a bench's configuration common to all backends."""

    @property
    def specimen(self) -> "Specimen":
        """The assumed specimen."""
        ...

    @property
    def lead_samples(self) -> int:
        """Number of drive samples queued ahead of the newest input sample."""
        ...

    @property
    def channels(self) -> "tuple[FurtherChannel, ...]":
        """Further analogue sensors."""
        ...


@dataclass(frozen=True)
class RigBackend:
    """A rig backend, named by the configuration key `backend`; the name is that of the entry point.

    `open(configuration, settings, realtime)` returns the rig, stopped; the caller closes it. If it raises InvalidInput
    or RigError, it leaves nothing open. `settings` is the class of its table in the configuration. `extras(settings)`
    returns the optional dependencies of this program that such settings require. `real_time_only` is True for a backend
    without virtual time, `operator` if a person performs the tasks between two tests.
    """

    open: "Callable[[CommonSettings, Any, bool], Rig]"
    settings: type[Parameters] = RigSettings
    extras: Callable[[Any], tuple[str, ...]] = lambda _settings: ()
    real_time_only: bool = True
    operator: bool = True


def backend_names() -> tuple[str, ...]:
    """The names of all installed backends, in alphabetical order; does not load them."""
    return plugin_names(RIGS)


def load_backend(name: str) -> RigBackend:
    """The backend `name`. Raises InvalidInput for a backend that is not installed or fails to load."""
    return load_plugin(RIGS, name, "backend", RigBackend)
