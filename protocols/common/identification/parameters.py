"""What the identification asks for: declared once, used by command line, file and documentation."""

from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import COUPLING, Parameters, quantity


class IdentifyParameters(Parameters):
    """Random-phase multisines at low level, with the specimen mounted; several realisations of several periods each."""

    beta: float | None = quantity(
        None,
        "1",
        "stiffness ratio of the spring that couples the block; absent: bare frame, no block",
        gt=0,
        le=100,
        usual=COUPLING,
    )
    band_low: float | None = quantity(
        None,
        "Hz",
        "lower end of the band; absent: half that of the table's band, as a replication needs it",
        gt=0,
        usual=(0.2, 1.8),
    )
    band_high: float | None = quantity(
        None,
        "Hz",
        "upper end of the band; absent: twice that of the table's band, as a replication needs it",
        gt=0,
        usual=(8.0, 80.0),
    )
    corner: float = quantity(
        1.0, "Hz", "the motion is flat in displacement below this frequency, in acceleration above", gt=0, le=50
    )
    level: float = quantity(
        0.6,
        "m/s2",
        "peak of the table's acceleration at most; less where the bench or a standing block asks for it",
        gt=0,
    )
    period: float = quantity(8.0, "s", "period of the multisines: one over the distance of their lines", ge=0.5, le=120)
    realisations: int = quantity(
        3, "1", "multisines with phases of their own: distortion shows between them", ge=2, le=50
    )
    periods: int = quantity(3, "1", "periods of each that are used: noise shows between them", ge=2, le=50)
    discarded: int | None = quantity(
        None,
        "1",
        "periods at the start of each that are left out; absent: until 2 % are left of what the start has excited",
        ge=1,
        le=100,
    )
    odd_lines: bool = quantity(False, "", "leave every other line out: those left carry no distortion of even order")
    phase_seed: int = quantity(1, "", "seed of the phases", ge=0, lt=2**32)

    @model_validator(mode="after")
    def _a_band(self) -> "IdentifyParameters":
        if self.band_low is not None and self.band_high is not None and self.band_low >= self.band_high:
            raise InvalidInput("band_high", self.band_high, f"it must be above band_low = {self.band_low:g} Hz")
        return self
