"""The configuration of a bench: what stands in the laboratory, as opposed to what a protocol asks for."""

from typing import Literal

from pydantic import model_validator

from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.sensor_accuracy import SensorAccuracy, SensorDoubt
from bench.config.twin import Twin
from bench.guard.limits import Limits, Ramps
from bench.guard.quantities import Mover
from drivers.further import FurtherChannel
from drivers.hardware.parameters import Hardware
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.knowledge import SpecimenKnowledge
from sim.parameters import Parameters, quantity
from sim.specimen import Specimen
from sim.uncertainty import SpecimenUncertainty
from sim.virtual_bench import VirtualBenchParameters

_BLOCKS_OF_WATCHDOG = 3
"""How many blocks a device's watchdog must outlast: one that is late is no dead program."""
_BLOCKS_OF_HEARTBEAT = 4
"""How many blocks the relay of a heartbeat must outlast: two of its periods."""
_SHORTEST_WITH_SERIAL_LASERS = 0.02
"""Shortest block with lasers whose values come in bursts of some milliseconds [s]."""


class Acquisition(Parameters):
    """How the samples travel."""

    block_duration: float = quantity(
        0.1, "s", "length of a block of samples: one turn of the loop that reads, guards and drives", ge=0.01, le=0.2
    )

    lead: float = quantity(
        0.1,
        "s",
        "drive that waits in the output ahead of what is read: covers the time a turn of the loop takes",
        ge=0.0,
        le=2.0,
    )


class Simulation(Parameters):
    """The virtual bench that the simulated backend runs on."""

    seed: int = quantity(1, "", "seed of every random number of the virtual bench", ge=0, lt=2**32)
    bench: VirtualBenchParameters = VirtualBenchParameters()
    specimen: Specimen | None = quantity(None, "", "the true specimen; absent when it is as assumed")
    spring_factor: float = quantity(
        1.0, "1", "true over nominal stiffness of every spring that is mounted", gt=0, le=10
    )


class BenchConfiguration(Parameters):
    """Everything that describes a bench. The defaults are the paper's specimen on the simulated bench."""

    backend: Literal["simulated", "hardware"] = quantity("simulated", "", "what drives and reads the bench")
    specimen: Specimen = Specimen()
    uncertainty: SpecimenUncertainty = SpecimenUncertainty()
    specimen_file: str | None = quantity(
        None,
        "",
        "JSON file of what has been identified of the specimen, read beside this file; absent: nothing has",
        example="specimen.json",
    )
    identified: Identified | None = quantity(
        None, "", "what has been identified of the specimen, in place of a specimen_file; goes before what is assumed"
    )
    laser_calibration: str | None = quantity(
        None,
        "",
        "JSON file of a calibration of the lasers, read beside this file; absent: their data sheets hold",
        example="laser_calibration.json",
    )
    calibrated: LaserCalibration | None = quantity(
        None, "", "a calibration of the lasers, in place of a laser_calibration file"
    )
    table_model: str | None = quantity(
        None,
        "",
        "JSON file of an identified table, from which the drive is predicted; absent: from the simulated shaker",
        example="table_model.json",
    )
    limits: Limits = Limits()
    ramps: Ramps = Ramps()
    acquisition: Acquisition = Acquisition()
    analysis: SensorAccuracy = SensorAccuracy()
    twin: Twin = Twin()
    simulation: Simulation = Simulation()
    hardware: Hardware = Hardware()
    channels: tuple[FurtherChannel, ...] = quantity((), "", "further analogue sensors, one table each")

    @property
    def known_specimen(self) -> Specimen:
        """The specimen as it is known best, for every prediction: identified where it was, assumed elsewhere."""
        return self.specimen if self.identified is None else self.identified.applied(self.specimen)

    @property
    def known(self) -> SpecimenKnowledge:
        """How well `known_specimen` is known."""
        return SpecimenKnowledge(**dict(self.uncertainty), identified=self.identified or Identified())

    @property
    def known_on_table(self) -> SpecimenKnowledge:
        """The same for a steady motion on this table, which may give way at the block's impacts.

        Its control gives the lost momentum back over the period, so predictions are for fixed ground; all that a table
        left to itself would take of the restitution is taken as a half width.
        """
        block, mass = self.known_specimen.block, self.table_mass
        if mass is None or block.restitution == 0.0:
            return self.known
        give = 1.0 - max(block.restitution_on(mass), 0.0) / block.restitution
        return self.known.model_copy(update={"give": give})

    @property
    def sensors(self) -> SensorDoubt:
        """All that is left open of the sensors."""
        return SensorDoubt(self.analysis, self.laser_ranges, self.calibrated)

    @property
    def seed(self) -> int | None:
        """Seed of every random number of the bench; a real one has none."""
        return self.simulation.seed if self.backend == "simulated" else None

    @property
    def sample_rate(self) -> float:
        """Samples per second of drive and inputs that the configured backend is asked for [1/s]."""
        return self.simulation.bench.sample_rate if self.backend == "simulated" else self.hardware.sample_rate

    @property
    def block_samples(self) -> int:
        """Samples in one turn of the acquisition loop."""
        return max(round(self.acquisition.block_duration * self.sample_rate), 1)

    @property
    def lead_samples(self) -> int:
        """Drive samples that wait ahead of the sample that is read."""
        return round(self.acquisition.lead * self.sample_rate)

    @property
    def half_stroke(self) -> float:
        """Displacement of the table from mid stroke at which the end stops touch [m]."""
        simulated = self.backend == "simulated"
        return self.simulation.bench.shaker.half_stroke if simulated else self.hardware.half_stroke

    @property
    def table_band(self) -> tuple[float, float]:
        """The band that the table can make [Hz]: records are limited to it before they are scaled."""
        table = self.simulation.bench.shaker if self.backend == "simulated" else self.hardware
        return table.band_low, table.band_high

    @property
    def mover(self) -> Mover | None:
        """What force and current are estimated from, with the known specimen on the table; None when unknown."""
        specimen, mass = self.known_specimen, self.table_mass
        payload = specimen.frame.m1 + specimen.frame.m2 + specimen.block.mass
        if self.backend == "simulated":
            shaker = self.simulation.bench.shaker
            return Mover(shaker.moving_mass + payload, shaker.k_s, shaker.bl)
        constant = self.hardware.force_constant
        return None if mass is None or constant is None else Mover(mass + payload, 0.0, constant)

    @property
    def table_mass(self) -> float | None:
        """Mass that moves with the table, without the specimen [kg]; None when unknown."""
        return self.simulation.bench.shaker.moving_mass if self.backend == "simulated" else self.hardware.moving_mass

    @property
    def laser_reference(self) -> Literal["ground", "table"]:
        """Where the lasers stand."""
        simulated = self.backend == "simulated"
        return self.simulation.bench.laser_1.reference if simulated else self.hardware.lasers.reference

    @property
    def laser_ranges(self) -> tuple[float, float]:
        """Measuring ranges of the lasers on the first and the second storey [m]."""
        lasers = self.simulation.bench if self.backend == "simulated" else self.hardware
        return lasers.laser_1.measuring_range, lasers.laser_2.measuring_range

    def at_pace(self, *, realtime: bool) -> "BenchConfiguration":
        """The same, with what depends on the pace of its time decided: hardware knows real time only."""
        if self.twin.enabled is not None:
            return self
        twin = self.twin.model_copy(update={"enabled": realtime or self.backend == "hardware"})
        return self.model_copy(update={"twin": twin})

    @property
    def serves_itself(self) -> bool:
        """Whether no person is needed for the work between two tests: the bench is simulated or emulated."""
        return self.backend == "simulated" or self.hardware.hands is not None

    @model_validator(mode="after")
    def _springs_belong_to_the_protocol(self) -> "BenchConfiguration":
        for name, specimen in (("specimen", self.specimen), ("simulation.specimen", self.simulation.specimen)):
            if specimen is not None and specimen.beta is not None:
                allowed = "the protocol says which springs are mounted; leave it out (see simulation.spring_factor)"
                raise InvalidInput(f"{name}.beta", specimen.beta, allowed)
        return self

    @model_validator(mode="after")
    def _what_is_identified_can_be(self) -> "BenchConfiguration":
        if self.specimen_file is not None and self.identified is not None:
            raise InvalidInput("specimen_file", self.specimen_file, "identified is there too; leave one of them out")
        try:
            _ = self.known_specimen
        except InvalidInput as refusal:
            raise InvalidInput(f"identified.{refusal.item}", refusal.value, refusal.allowed) from None
        return self

    @model_validator(mode="after")
    def _channels_of_their_own(self) -> "BenchConfiguration":
        hardware = self.hardware
        terminals = {each.terminal.lower(): name for name, each in (*hardware.transducers, *hardware.analogue_lasers)}
        names = set[str]()
        for number, channel in enumerate(self.channels):
            item = f"channels[{number}]"
            if channel.name in names:
                raise InvalidInput(f"{item}.name", channel.name, "another channel has this name; give it its own")
            names.add(channel.name)
            if self.backend == "simulated":
                try:
                    _ = channel.simulated
                except InvalidInput as refusal:
                    raise InvalidInput(f"{item}.{refusal.item}", refusal.value, refusal.allowed) from None
            elif (other := terminals.setdefault(channel.terminal.lower(), channel.name)) != channel.name:
                raise InvalidInput(f"{item}.terminal", channel.terminal, f"{other} has this terminal already")
        return self

    @model_validator(mode="after")
    def _one_calibration(self) -> "BenchConfiguration":
        if self.laser_calibration is not None and self.calibrated is not None:
            allowed = "calibrated is there too; leave one of them out"
            raise InvalidInput("laser_calibration", self.laser_calibration, allowed)
        return self

    @model_validator(mode="after")
    def _blocks_suit_the_devices(self) -> "BenchConfiguration":
        block, watchdog = self.acquisition.block_duration, self.hardware.daq.watchdog
        if self.backend != "hardware":
            return self
        if watchdog is not None and watchdog < _BLOCKS_OF_WATCHDOG * block:
            allowed = f"it is told once in a block of {block:g} s: give it at least {_BLOCKS_OF_WATCHDOG} blocks"
            raise InvalidInput("hardware.daq.watchdog", watchdog, allowed)
        heartbeat = self.hardware.daq.heartbeat
        if heartbeat is not None and heartbeat.timeout < _BLOCKS_OF_HEARTBEAT * block:
            allowed = (
                f"it rises every other block of {block:g} s: give its relay at least {_BLOCKS_OF_HEARTBEAT} blocks"
            )
            raise InvalidInput("hardware.daq.heartbeat.timeout", heartbeat.timeout, allowed)
        if self.hardware.lasers.connection == "serial" and block < _SHORTEST_WITH_SERIAL_LASERS:
            allowed = f"serial lasers come in bursts: at least {_SHORTEST_WITH_SERIAL_LASERS:g} s, or analogue lasers"
            raise InvalidInput("acquisition.block_duration", block, allowed)
        return self
