"""What a drive will ask of the table, and which limit binds first."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.control.target import integrated
from bench.guard.limits import Limits

Array = NDArray[np.float64]

UNITS = {"drive_voltage": "V", "drive_slew": "V/s", "displacement": "m", "velocity": "m/s", "acceleration": "m/s2"}


@dataclass(frozen=True)
class Envelope:
    """The motion and drive of one pass: for each name of `UNITS`, which are those of `Limits`, a series, shape (n,)."""

    series: Mapping[str, Array]

    @staticmethod
    def of(volts: Array, acceleration: Array, displacement: Array | None, sample_rate: float) -> "Envelope":
        """From volts and table acceleration [m/s2], whose part at zero frequency is left out of the integrals.

        `displacement` [m] is that measured; without it the acceleration is integrated twice.
        """
        velocity, integral = integrated(acceleration, sample_rate)
        displacement = integral if displacement is None else displacement
        slew = np.diff(volts, prepend=0.0) * sample_rate
        return Envelope(dict(zip(UNITS, (volts, slew, displacement, velocity, acceleration), strict=True)))

    @property
    def peaks(self) -> dict[str, float]:
        """Largest magnitude of each series, in its unit."""
        return {name: float(np.abs(values).max()) for name, values in self.series.items()}


@dataclass(frozen=True)
class Verdict:
    """How much of a change fits: `share` 0 to 1, and the limit that `binds` when it is less than 1."""

    share: float
    binds: str | None
    wanted: float
    allowed: float

    def __str__(self) -> str:
        if self.binds is None:
            return "within every limit"
        unit = UNITS[self.binds]
        return (
            f"{self.binds} of {self.wanted:.4g} {unit} is beyond the {self.allowed:.4g} {unit} that its limit leaves;"
            f" {self.share:.1%} of it fits"
        )


def fitting(present: Envelope, change: Envelope, limits: Limits, margin: float) -> Verdict:
    """How much of `change` may be added to `present` so that everything stays below its limit over `margin`."""
    share, binds, wanted, allowed = 1.0, None, 0.0, 0.0
    for name in UNITS:
        base, step = present.series[name], change.series[name]
        limit = float(getattr(limits, name)) / margin
        # room in the direction of the step; where it is used up already, nothing of this step fits
        room = limit - np.sign(step) * base
        moving = np.abs(step) > 1e-12 * limit
        fits = float(np.min(room[moving] / np.abs(step[moving]), initial=np.inf))
        if fits < share:
            share, binds = max(fits, 0.0), name
            wanted, allowed = float(np.abs(base + step).max()), limit
    return Verdict(share, binds, wanted, allowed)
