"""The configuration of a bench: the laboratory's equipment, without the parameters of protocols."""

from typing import Any, Literal, cast

from pydantic import SerializeAsAny, ValidationInfo, field_validator, model_validator

from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.config.backend import RigSettings, load_backend
from bench.config.sections import Acquisition, Simulation, Twin
from bench.config.validation import validated
from bench.guard.limits import Limits, Ramps
from bench.guard.shaker import ShakerModel
from drivers.further import FurtherChannel
from drivers.hardware.parameters import Hardware
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.knowledge import SpecimenKnowledge, SpecimenUncertainty
from sim.parameters import Parameters, quantity
from sim.shaker import Shaker
from sim.specimen import Specimen

_BLOCKS_OF_WATCHDOG = 3
"""Minimum time-out of a device's watchdog, in blocks: a single late block must not trip it."""
_BLOCKS_OF_HEARTBEAT = 4
"""Minimum time-out of a heartbeat relay, in blocks: two heartbeat periods."""
_SHORTEST_WITH_SERIAL_LASERS = 0.02
"""Shortest duration of a block with serial lasers [s]; their values arrive in bursts of a few milliseconds."""

_TABLES: dict[str, Literal["simulation", "hardware"]] = {"simulated": "simulation", "hardware": "hardware"}
"""Configuration tables of the built-in backends; any other backend uses `rig`."""


class BenchConfiguration(Parameters):
    """Complete description of a bench. The defaults describe the paper's specimen on the simulated bench."""

    backend: str = quantity(
        "simulated", "", 'driver of the bench: "simulated", "hardware", or a backend of another package'
    )
    specimen: Specimen = Specimen()
    uncertainty: SpecimenUncertainty = SpecimenUncertainty()
    specimen_file: str | None = quantity(
        None,
        "",
        "JSON file of the specimen's identified properties, relative to this file; if absent, there are none",
        example="specimen.json",
    )
    identified: Identified | None = quantity(
        None, "", "the specimen's identified properties, in place of a specimen_file; they replace assumed values"
    )
    laser_calibration: str | None = quantity(
        None,
        "",
        "JSON file of a laser calibration, relative to this file; if absent, the data sheets apply",
        example="laser_calibration.json",
    )
    calibrated: LaserCalibration | None = quantity(
        None, "", "a laser calibration, in place of a laser_calibration file"
    )
    table_model: str | None = quantity(
        None,
        "",
        "JSON file of an identified table model, relative to this file, used to predict the drive; if absent, the "
        "drive is predicted for the simulated bench only, from its shaker",
        example="table_model.json",
    )
    limits: Limits = Limits()
    ramps: Ramps = Ramps()
    acquisition: Acquisition = Acquisition()
    analysis: SensorAccuracy = SensorAccuracy()
    twin: Twin = Twin()
    simulation: Simulation = Simulation()
    hardware: Hardware = Hardware()
    rig: SerializeAsAny[Parameters] | None = quantity(
        None, "", "settings of a backend of another package; the backend declares the keys", validate_default=True
    )
    channels: tuple[FurtherChannel, ...] = quantity((), "", "additional analogue sensors, one table each")

    @property
    def known_specimen(self) -> Specimen:
        """Best estimate of the specimen, used for every prediction: identified properties replace assumed ones."""
        return self.specimen if self.identified is None else self.identified.applied(self.specimen)

    @property
    def known(self) -> SpecimenKnowledge:
        """Uncertainty of `known_specimen`."""
        return SpecimenKnowledge(**dict(self.uncertainty), identified=self.identified or Identified())

    @property
    def known_on_table(self) -> SpecimenKnowledge:
        """Uncertainty of `known_specimen` in a steady motion on this table, which recoils at the block's impacts.

        The control restores the lost momentum within a period, so predictions assume fixed ground; the full effect of
        an uncontrolled table on the restitution is added as a half width.
        """
        block, mass = self.known_specimen.block, self.table_mass
        if mass is None or block.restitution == 0.0:
            return self.known
        give = 1.0 - max(block.restitution_on(mass), 0.0) / block.restitution
        return self.known.model_copy(update={"give": give})

    @property
    def sensors(self) -> SensorUncertainty:
        """Uncertainty of the sensors, from the table `analysis`, the lasers' ranges and their calibration."""
        return SensorUncertainty(self.analysis, self.laser_ranges, self.calibrated)

    @property
    def table(self) -> Literal["simulation", "hardware", "rig"]:
        """Name of the TOML table with the settings of the configured backend."""
        return _TABLES.get(self.backend, "rig")

    @property
    def settings(self) -> Simulation | Hardware | RigSettings:
        """Settings of the configured backend."""
        if self.backend == "simulated":
            return self.simulation
        if self.backend == "hardware":
            return self.hardware
        return self.rig if isinstance(self.rig, RigSettings) else RigSettings()

    @property
    def seed(self) -> int | None:
        """Random seed of the simulated bench; None for any other backend."""
        return self.simulation.seed if self.backend == "simulated" else None

    @property
    def sample_rate(self) -> float:
        """Samples per second of drive and inputs requested from the configured backend [1/s]."""
        return self.settings.sample_rate

    @property
    def block_samples(self) -> int:
        """Number of samples in a block, which is one iteration of the acquisition loop."""
        return max(round(self.acquisition.block_duration * self.sample_rate), 1)

    @property
    def lead_samples(self) -> int:
        """Number of drive samples queued ahead of the newest input sample."""
        return round(self.acquisition.lead * self.sample_rate)

    @property
    def half_stroke(self) -> float:
        """Distance from mid stroke to each end stop of the table [m]."""
        return self.settings.half_stroke

    @property
    def table_band(self) -> tuple[float, float]:
        """The table's usable band [Hz], to which records can be limited before scaling."""
        return self.settings.band_low, self.settings.band_high

    @property
    def shaker_model(self) -> ShakerModel | None:
        """Model of the shaker loaded with the known specimen; None if moving mass or force constant is absent."""
        specimen, mass = self.known_specimen, self.table_mass
        payload = specimen.frame.m1 + specimen.frame.m2 + specimen.block.mass
        constant = self.settings.force_constant
        return (
            None
            if mass is None or constant is None
            else ShakerModel(mass + payload, self.settings.suspension, constant)
        )

    @property
    def simulated_shaker(self) -> Shaker | None:
        """The shaker of the simulated bench; None for any other backend, whose amplifier and friction are not known."""
        return self.simulation.bench.shaker if self.backend == "simulated" else None

    @property
    def table_mass(self) -> float | None:
        """Mass that moves with the table, without the specimen [kg]; None when unknown."""
        return self.settings.moving_mass

    @property
    def laser_reference(self) -> Literal["ground", "table"]:
        """Mounting of the lasers: "ground" or "table"."""
        return self.settings.laser_reference

    @property
    def laser_ranges(self) -> tuple[float, float]:
        """Measuring ranges of the lasers on the first and the second storey [m]."""
        return self.settings.laser_ranges

    @property
    def laser_half_ranges(self) -> tuple[float, float]:
        """Largest displacement from mid range that the lasers on the first and the second storey can measure [m]."""
        return 0.5 * self.laser_ranges[0], 0.5 * self.laser_ranges[1]

    def at_pace(self, *, realtime: bool) -> "BenchConfiguration":
        """The configuration with a value for every setting whose default depends on whether time is virtual or real."""
        if self.twin.enabled is not None:
            return self
        twin = self.twin.model_copy(update={"enabled": realtime or self.real_time_only})
        return self.model_copy(update={"twin": twin})

    @property
    def real_time_only(self) -> bool:
        """Whether the backend has no virtual time."""
        return load_backend(self.backend).real_time_only

    @property
    def serves_itself(self) -> bool:
        """Whether tasks between two tests need no operator, as on the simulated and on an emulated bench."""
        if self.backend == "hardware":
            return self.hardware.emulator_address is not None
        return not load_backend(self.backend).operator

    @field_validator("backend")
    @classmethod
    def _installed_backend(cls, name: str) -> str:
        # validation does not load the built-in backends
        if name not in _TABLES:
            try:
                load_backend(name)
            except InvalidInput as refused:
                raise ValueError(refused.allowed) from refused
        return name

    @field_validator("rig", mode="plain")
    @classmethod
    def _backend_settings(cls, given: Any, info: ValidationInfo) -> RigSettings | None:
        name = info.data.get("backend")
        if name is None:
            return None
        if name in _TABLES:
            if given is not None:
                raise ValueError(f'the settings of the backend "{name}" are in [{_TABLES[name]}]; remove [rig]')
            return None
        settings = load_backend(name).settings
        if not issubclass(settings, RigSettings):
            raise ValueError(
                f'the settings class of the backend "{name}" is not a subclass of {RigSettings.__module__}.RigSettings'
            )
        if isinstance(given, settings):
            return given
        if not isinstance(given, dict | None):
            raise ValueError("it must be a table of keys")
        return validated(settings, cast(dict[str, Any], given or {}))

    @model_validator(mode="after")
    def _check_spring(self) -> "BenchConfiguration":
        for name, specimen in (("specimen", self.specimen), ("simulation.specimen", self.simulation.specimen)):
            if specimen is not None and specimen.beta is not None:
                allowed = "the protocol selects the springs; remove it (see simulation.spring_factor)"
                raise InvalidInput(f"{name}.beta", specimen.beta, allowed)
        return self

    @model_validator(mode="after")
    def _check_files(self) -> "BenchConfiguration":
        for file, content in (("specimen_file", "identified"), ("laser_calibration", "calibrated")):
            if None not in (path := getattr(self, file), getattr(self, content)):
                raise InvalidInput(file, path, f"{content} is also present; remove one of them")
        return self

    @model_validator(mode="after")
    def _check_identified(self) -> "BenchConfiguration":
        try:
            _ = self.known_specimen
        except InvalidInput as refusal:
            raise InvalidInput(f"identified.{refusal.item}", refusal.value, refusal.allowed) from None
        return self

    @model_validator(mode="after")
    def _check_channels_unique(self) -> "BenchConfiguration":
        hardware = self.hardware
        terminals = {each.terminal.lower(): name for name, each in (*hardware.transducers, *hardware.analogue_lasers)}
        names = set[str]()
        for number, channel in enumerate(self.channels):
            item = f"channels[{number}]"
            if channel.name in names:
                allowed = "another channel has this name; choose a different one"
                raise InvalidInput(f"{item}.name", channel.name, allowed)
            names.add(channel.name)
            if self.backend == "simulated":
                try:
                    _ = channel.simulated
                except InvalidInput as refusal:
                    raise InvalidInput(f"{item}.{refusal.item}", refusal.value, refusal.allowed) from None
            if self.backend != "hardware":
                continue
            if (other := terminals.setdefault(channel.terminal.lower(), channel.name)) != channel.name:
                raise InvalidInput(f"{item}.terminal", channel.terminal, f"{other} already uses this terminal")
        return self

    @model_validator(mode="after")
    def _check_block_duration(self) -> "BenchConfiguration":
        block, watchdog = self.acquisition.block_duration, self.hardware.daq.watchdog
        if self.backend != "hardware":
            return self
        if watchdog is not None and watchdog < _BLOCKS_OF_WATCHDOG * block:
            allowed = (
                f"the watchdog is reset once per block of {block:g} s: set a time-out of {_BLOCKS_OF_WATCHDOG} blocks "
                "or more"
            )
            raise InvalidInput("hardware.daq.watchdog", watchdog, allowed)
        heartbeat = self.hardware.daq.heartbeat
        if heartbeat is not None and heartbeat.timeout < _BLOCKS_OF_HEARTBEAT * block:
            allowed = (
                f"the heartbeat has one rising edge in two blocks, and a block lasts {block:g} s: set a time-out of "
                f"{_BLOCKS_OF_HEARTBEAT} blocks or more"
            )
            raise InvalidInput("hardware.daq.heartbeat.timeout", heartbeat.timeout, allowed)
        if self.hardware.lasers.connection == "serial" and block < _SHORTEST_WITH_SERIAL_LASERS:
            allowed = (
                f"serial lasers send data in bursts: use at least {_SHORTEST_WITH_SERIAL_LASERS:g} s, or analogue "
                "lasers"
            )
            raise InvalidInput("acquisition.block_duration", block, allowed)
        return self
