"""How far and how fast a record may move the table."""

from dataclasses import dataclass
from math import isfinite

from bench.analysis.table_motion import TableMotion
from bench.config.model import BenchConfiguration
from sim.errors import InvalidInput

SHARE = 0.9
"""Share of stroke and limits that a record may use: the table does not follow to the last millimetre."""


@dataclass(frozen=True)
class Reach:
    """Largest |displacement| [m] and |velocity| [m/s] of the table. Raises InvalidInput unless both are positive."""

    displacement: float
    velocity: float

    def __post_init__(self) -> None:
        for name, value in (("displacement", self.displacement), ("velocity", self.velocity)):
            if not (isfinite(value) and value > 0.0):
                raise InvalidInput(name, value, "what the table may do must be a positive number")

    @staticmethod
    def of(configuration: BenchConfiguration, share: float = SHARE) -> "Reach":
        """`share` of what stroke and limits of a bench allow."""
        limits = configuration.limits
        return Reach(share * min(configuration.half_stroke, limits.displacement), share * limits.velocity)

    def holds(self, motion: TableMotion) -> bool:
        """Whether the motion stays within."""
        return motion.peak_displacement <= self.displacement and motion.peak_velocity <= self.velocity
