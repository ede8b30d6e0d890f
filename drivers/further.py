"""Additional analogue sensors, one configuration table each."""

from typing import Literal

from pydantic import model_validator

from drivers.hardware.parameters import CalibratedInput
from sim.channel import COIL_CURRENT, STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT, TABLE_FORCE
from sim.errors import InvalidInput
from sim.parameters import quantity
from sim.sensors import SIMULATED, Place, PlacedSensor

TAKEN = (
    *(TABLE_DISPLACEMENT, TABLE_ACCELERATION, TABLE_FORCE, COIL_CURRENT, *STOREYS),
    *("drive", "time", "blocks", "alignments", "sample_rate"),
)
"""Reserved names: other channels and datasets of the data file."""


class FurtherChannel(CalibratedInput):
    """An additional analogue sensor, which is recorded, displayed, exported, and monitored for lost and stuck samples
    like every other channel; its magnitude is limited if it has a limit.

    On hardware it is a DAQ input; on the simulated bench it measures the motion of `place`.
    """

    name: str = quantity(..., "", "name of the channel", pattern=r"^[a-z][a-z0-9_]*$", example="storey_2_acceleration")
    measures: Literal["acceleration", "velocity", "displacement", "force", "strain", "current", "voltage"] = quantity(
        ..., "", "measured quantity", example="acceleration"
    )
    unit: str = quantity(..., "", "SI unit of the quantity", min_length=1, example="m/s2")
    place: Place = quantity(..., "", "part of the bench on which the sensor is mounted", example="storey 2")
    sensitivity: float = quantity(
        ..., "V/unit", "volts per unit as calibrated; the sign gives the polarity", usual=(1e-6, 1e6), example=0.1
    )
    zero: float = quantity(0.0, "V", "voltage when the quantity is zero", usual=(1e-3, 2.0))
    limit: float | None = quantity(
        None,
        "unit",
        "largest permitted magnitude relative to the value at rest; beyond it the guard aborts; if absent, the "
        "magnitude is not limited",
        gt=0,
        example=20.0,
    )
    warning: float = quantity(0.9, "1", "fraction of the limit above which the operator is warned", gt=0, le=1)
    debounce: float = quantity(0.003, "s", "time for which the limit must be exceeded before it trips", ge=0, le=1)
    noise_density: float = quantity(
        0.0, "unit/Hz^0.5", "amplitude spectral density of the simulated sensor's white noise", ge=0, example=2e-4
    )

    @model_validator(mode="after")
    def _check_name(self) -> "FurtherChannel":
        if self.name in TAKEN:
            raise InvalidInput("name", self.name, "this name is reserved; choose a different one")
        return self

    @model_validator(mode="after")
    def _check_limit(self) -> "FurtherChannel":
        reach = (self.range - abs(self.zero)) / abs(self.sensitivity)
        if self.limit is not None and self.limit > reach:
            scale = f"range = {self.range:g} V, zero = {self.zero:g} V and sensitivity = {self.sensitivity:g}"
            allowed = f"with {scale} the channel measures only up to {reach:.4g} {self.unit}; reduce the limit"
            raise InvalidInput("limit", self.limit, allowed)
        return self

    @property
    def simulated(self) -> PlacedSensor:
        """The sensor's model on the simulated bench. Raises InvalidInput for an unsupported quantity or place."""
        if self.measures not in SIMULATED or self.place == "elsewhere":
            allowed = f"the simulated bench provides, for the table and the storeys, only: {', '.join(SIMULATED)}"
            raise InvalidInput("measures", f"{self.measures} of {self.place}", allowed)
        return PlacedSensor(
            name=self.name,
            measures=self.measures,
            unit=self.unit,
            place=self.place,
            sensitivity=self.sensitivity,
            zero=self.zero,
            noise_density=self.noise_density,
        )
