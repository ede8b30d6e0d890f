"""Parameters of the table identification."""

from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import COUPLING, Parameters, quantity


class IdentifyParameters(Parameters):
    """Random-phase multisines at low level with the specimen mounted: several realisations of several periods each."""

    beta: float | None = quantity(
        None,
        "1",
        "stiffness ratio of the spring that couples the block; if absent, only the bare frame is on the table",
        gt=0,
        le=100,
        usual=COUPLING,
    )
    band_low: float | None = quantity(
        None,
        "Hz",
        "lower end of the band; if absent, half the lower end of the table's band, as required for replication",
        gt=0,
        usual=(0.2, 1.8),
    )
    band_high: float | None = quantity(
        None,
        "Hz",
        "upper end of the band; if absent, twice the upper end of the table's band, as required for replication",
        gt=0,
        usual=(8.0, 80.0),
    )
    corner: float = quantity(
        1.0,
        "Hz",
        "frequency below which the lines have equal displacement amplitudes, and above which they have equal "
        "acceleration amplitudes",
        gt=0,
        le=50,
    )
    level: float = quantity(
        0.6,
        "m/s2",
        "peak of the table's acceleration, reduced if a limit of the bench or the resting block requires it",
        gt=0,
    )
    period: float = quantity(8.0, "s", "period of the multisines, the inverse of their line spacing", ge=0.5, le=120)
    realisations: int = quantity(
        3, "1", "number of multisines with different phases; their differences show the distortion", ge=2, le=50
    )
    periods: int = quantity(
        3, "1", "number of periods of each multisine that are used; their differences show the noise", ge=2, le=50
    )
    discarded: int | None = quantity(
        None,
        "1",
        "number of periods discarded at the start of each multisine; if absent, until the starting transient "
        "has decayed to 2 %",
        ge=1,
        le=100,
    )
    odd_lines: bool = quantity(
        False, "", "whether every other line is omitted, so that the remaining lines are free of even-order distortion"
    )
    phase_seed: int = quantity(1, "", "random seed for the phases", ge=0, lt=2**32)

    @model_validator(mode="after")
    def _check_band(self) -> "IdentifyParameters":
        if self.band_low is not None and self.band_high is not None and self.band_low >= self.band_high:
            raise InvalidInput("band_high", self.band_high, f"it must be above band_low = {self.band_low:g} Hz")
        return self
