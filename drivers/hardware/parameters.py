"""Parameters of the laboratory bench: table `[hardware]` of a configuration."""

from typing import Literal

from pydantic import model_validator

from drivers.daqmx.parameters import AnalogInput, Daq
from sim.channel import COIL_CURRENT, STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT, TABLE_FORCE
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity


class CalibratedInput(AnalogInput):
    """An input with a linear calibration."""

    sensitivity: float
    zero: float

    @model_validator(mode="after")
    def _check_calibration(self) -> "CalibratedInput":
        if self.sensitivity == 0.0:
            raise InvalidInput("sensitivity", self.sensitivity, "it must not be 0")
        if abs(self.zero) >= self.range:
            raise InvalidInput("zero", self.zero, f"it must be within the input's range of {self.range:g} V")
        return self


class TableDisplacement(CalibratedInput):
    """Input of the displacement transducer between table and ground."""

    sensitivity: float = quantity(100.0, "V/m", "volts per metre as calibrated; the sign gives the polarity")
    zero: float = quantity(0.0, "V", "voltage at mid stroke", usual=(1e-3, 2.0))


class TableAcceleration(CalibratedInput):
    """Input of the table's accelerometer."""

    terminal: str = quantity("Dev1/ai1", "", "physical channel of the input")
    sensitivity: float = quantity(1.0, "V s2/m", "volts per m/s2 as calibrated; the sign gives the polarity")
    zero: float = quantity(0.0, "V", "voltage at rest", usual=(1e-3, 2.0))


class TableForce(CalibratedInput):
    """Input of a load cell between armature and table."""

    terminal: str = quantity("Dev1/ai4", "", "physical channel of the input")
    sensitivity: float = quantity(0.01, "V/N", "volts per newton as calibrated; the sign gives the polarity")
    zero: float = quantity(0.0, "V", "voltage without force", usual=(1e-3, 2.0))


class CoilCurrent(CalibratedInput):
    """Input of the amplifier's current monitor."""

    terminal: str = quantity("Dev1/ai5", "", "physical channel of the input")
    sensitivity: float = quantity(0.2, "V/A", "volts per ampere as calibrated; the sign gives the polarity")
    zero: float = quantity(0.0, "V", "voltage without current", usual=(1e-3, 2.0))


Transducer = TableDisplacement | TableAcceleration | TableForce | CoilCurrent


class Lasers(Parameters):
    """Parameters of both lasers."""

    connection: Literal["serial", "analogue"] = quantity(
        "serial",
        "",
        "connection of both lasers: a sensor cannot use its serial line and its analogue output at the same time",
    )
    reference: Literal["ground", "table"] = quantity(
        "ground",
        "",
        "where the lasers are mounted: on the ground they measure a storey's absolute displacement, on the table its "
        "displacement relative to the table",
    )
    rate: float = quantity(4000.0, "1/s", "measuring rate of each laser", gt=0, le=8000)
    delay: float = quantity(
        0.0,
        "s",
        "correction added to the times of the laser values; `rockbench check` measures it",
        ge=-0.1,
        le=0.1,
        usual=(1e-4, 0.05),
    )
    observation_time: float = quantity(
        10.0,
        "s",
        "time for which the lasers are observed before the first run, to determine the rates of their clocks",
        ge=1,
        le=120,
        formerly="listening",
    )
    load: float = quantity(500.0, "ohm", "load resistor of an analogue current output", gt=0)


class LaserInput(AnalogInput):
    """A laser on a storey; terminal, wiring and range apply to its analogue output."""

    port: str | None = quantity(
        None,
        "",
        "serial port, such as COM5 or /dev/ttyUSB0, or socket://HOST:PORT of a serial device server; required for the "
        "serial connection",
        example="COM5",
    )
    serial_number: str | None = quantity(
        None,
        "",
        "serial number of the sensor, to detect swapped ports; if absent, any sensor with the configured "
        "measuring range is accepted",
        min_length=1,
        example="15030002",
    )
    baud: int | None = quantity(
        None, "1/s", "baud rate; if absent, it is detected automatically", ge=9600, le=1_000_000, example=921600
    )
    measuring_range: float = quantity(
        0.200, "m", "measuring range; checked against the sensor if connected serially", gt=0
    )
    polarity: Literal[1, -1] = quantity(1, "", "1 if the distance grows with the displacement of the storey, else -1")


class Laser1(LaserInput):
    """The laser on the first storey; terminal, wiring and range apply to its analogue output."""

    terminal: str = quantity("Dev1/ai2", "", "physical channel of the input")


class Laser2(LaserInput):
    """The laser on the second storey; terminal, wiring and range apply to its analogue output."""

    terminal: str = quantity("Dev1/ai3", "", "physical channel of the input")
    port: str | None = quantity(
        None,
        "",
        "serial port, such as COM6 or /dev/ttyUSB1, or socket://HOST:PORT of a serial device server; required for the "
        "serial connection",
        example="COM6",
    )


class Hardware(Parameters):
    """The laboratory bench: DAQ device, table transducers and lasers."""

    sample_rate: float = quantity(2000.0, "1/s", "samples per second of drive and inputs", gt=0, le=20_000)
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
        "force constant of the coil, used to estimate its current; if absent, force and current are not estimated",
        gt=0,
        usual=(5.0, 200.0),
        example=50.0,
    )
    emulator_address: str | None = quantity(
        None,
        "",
        "host:port of the control channel of an emulated laboratory; absent on a real bench",
        formerly="hands",
    )
    daq: Daq = Daq()
    table_displacement: TableDisplacement = TableDisplacement()
    table_acceleration: TableAcceleration = TableAcceleration()
    table_force: TableForce | None = quantity(None, "", "the load cell; absent if there is none")
    coil_current: CoilCurrent | None = quantity(None, "", "the current monitor; absent if there is none")
    lasers: Lasers = Lasers()
    laser_1: Laser1 = Laser1()
    laser_2: Laser2 = Laser2()

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        return self.daq.output_range

    @property
    def suspension(self) -> float:
        """Stiffness between table and ground [N/m]; always 0, since the configuration does not include it."""
        return 0.0

    @property
    def laser_reference(self) -> Literal["ground", "table"]:
        """Reference of the lasers: on the ground or on the table."""
        return self.lasers.reference

    @property
    def laser_ranges(self) -> tuple[float, float]:
        """Measuring ranges of the lasers on the first and the second storey [m]."""
        return self.laser_1.measuring_range, self.laser_2.measuring_range

    @property
    def transducers(self) -> tuple[tuple[str, Transducer], ...]:
        """The analogue inputs other than the lasers: channel name and input."""
        given = (
            (TABLE_DISPLACEMENT, self.table_displacement),
            (TABLE_ACCELERATION, self.table_acceleration),
            (TABLE_FORCE, self.table_force),
            (COIL_CURRENT, self.coil_current),
        )
        return tuple((name, one) for name, one in given if one is not None)

    @property
    def analogue_lasers(self) -> tuple[tuple[str, LaserInput], ...]:
        """Channel name and input of the lasers with the analogue connection; empty with the serial one."""
        return () if self.lasers.connection == "serial" else self._lasers

    @property
    def serial_lasers(self) -> tuple[tuple[str, LaserInput], ...]:
        """Channel name and input of the lasers with the serial connection; empty with the analogue one."""
        return self._lasers if self.lasers.connection == "serial" else ()

    @property
    def _lasers(self) -> tuple[tuple[str, LaserInput], ...]:
        return (STOREYS[0], self.laser_1), (STOREYS[1], self.laser_2)

    @model_validator(mode="after")
    def _check_terminals_unique(self) -> "Hardware":
        seen: dict[str, str] = {}
        for name, given in (*self.transducers, *self.analogue_lasers):
            if (other := seen.setdefault(given.terminal.lower(), name)) != name:
                raise InvalidInput(f"{name}.terminal", given.terminal, f"{other} already uses this terminal")
        serial = self.lasers.connection == "serial"
        if serial and self.laser_1.port is not None and self.laser_1.port == self.laser_2.port:
            raise InvalidInput("laser_2.port", self.laser_2.port, "laser_1 already uses this port")
        return self
