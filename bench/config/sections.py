"""Sections of the configuration: acquisition, simulation and live twin."""

from typing import Literal

from sim.parameters import Parameters, quantity
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters


class Acquisition(Parameters):
    """Timing of the acquisition loop."""

    block_duration: float = quantity(
        0.1,
        "s",
        "duration of a block of samples, which is one iteration of the acquisition loop",
        ge=0.005,
        le=0.2,
    )

    lead: float = quantity(
        0.1,
        "s",
        "duration of the drive queued in the output ahead of the newest input sample, to bridge a loop iteration",
        ge=0.0,
        le=2.0,
    )


Profile = Literal["fast", "steady"]
"""Reaction profiles: "fast" for short blocks and a short lead, "steady" for a busy computer."""
FAST, FAST_OVER_NETWORK, STEADY = (0.005, 0.01), (0.01, 0.02), (0.1, 0.1)
"""Block duration and lead [s]: fast on this computer, fast through a gRPC server, and steady, which is the default."""


def acquisition_of(profile: Profile, *, networked: bool) -> Acquisition:
    """Timing of a reaction profile; `networked` is for a gRPC server, where each call takes longer."""
    fast = FAST_OVER_NETWORK if networked else FAST
    block, lead = fast if profile == "fast" else STEADY
    return Acquisition(block_duration=block, lead=lead)


class Simulation(Parameters):
    """The virtual bench of the simulated backend."""

    seed: int = quantity(1, "", "random seed of the virtual bench", ge=0, lt=2**32)
    bench: VirtualBenchParameters = VirtualBenchParameters()
    specimen: Specimen | None = quantity(None, "", "the simulated specimen; if absent, the assumed specimen")
    spring_factor: float = quantity(1.0, "1", "ratio of true to nominal stiffness of every mounted spring", gt=0, le=10)

    @property
    def sample_rate(self) -> float:
        """Sample rate of drive and inputs [1/s]."""
        return self.bench.sample_rate

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        return self.bench.shaker.drive_range

    @property
    def half_stroke(self) -> float:
        """Distance from mid stroke to each end stop of the table [m]."""
        return self.bench.shaker.half_stroke

    @property
    def band_low(self) -> float:
        """Lower end of the table's usable band [Hz]."""
        return self.bench.shaker.band_low

    @property
    def band_high(self) -> float:
        """Upper end of the table's usable band [Hz]."""
        return self.bench.shaker.band_high

    @property
    def moving_mass(self) -> float:
        """Mass that moves with the table, without the specimen [kg]."""
        return self.bench.shaker.moving_mass

    @property
    def force_constant(self) -> float:
        """Force of the coil per ampere [N/A]."""
        return self.bench.shaker.bl

    @property
    def suspension(self) -> float:
        """Stiffness between table and ground [N/m]."""
        return self.bench.shaker.k_s

    @property
    def laser_reference(self) -> Literal["ground", "table"]:
        """Mounting of the lasers: "ground" or "table"."""
        return self.bench.laser_1.reference

    @property
    def laser_ranges(self) -> tuple[float, float]:
        """Measuring ranges of the lasers on the first and the second storey [m]."""
        return self.bench.laser_1.measuring_range, self.bench.laser_2.measuring_range


class Twin(Parameters):
    """The live twin: the model of the specimen under the measured motion of the table."""

    enabled: bool | None = quantity(
        None,
        "",
        "whether the model runs during every test; if absent, only in real time (in virtual time it doubles the cost)",
        example=True,
    )
    members: int = quantity(
        39,
        "",
        "number of random specimens that represent the uncertainty of the mounted specimen; the band of n "
        "specimens covers a measurement with probability (n - 1)/(n + 1)",
        ge=0,
        le=199,
    )
    seed: int = quantity(1, "", "random seed of the random specimens", ge=0, lt=2**32)
    laser_lag: float | None = quantity(
        None,
        "s",
        "delay of the lasers relative to the table's sensors; if absent, computed from the settings of the lasers",
        ge=-0.02,
        le=0.02,
        usual=(1e-4, 0.015),
        example=0.001,
    )
    residual_warn: float | None = quantity(
        0.15,
        "1",
        "limit of the relative rms distance of the measured drift from the band, above which a warning is issued",
        gt=0,
    )
    residual_stop: float | None = quantity(
        None,
        "1",
        "limit of the relative rms distance of the measured drift from the band, above which the run ends with a "
        "smooth ramp; if absent, never",
        gt=0,
        example=0.5,
    )
    persistence: float = quantity(
        2.0, "s", "time for which a residual must exceed its limit before the limit trips", ge=0, le=60
    )
