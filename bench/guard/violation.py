"""A limit that was reached."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Violation:
    """`quantity` reached `value` where `limit` is allowed, in `unit`; the sample's index since arming.

    `of_table` says that the table itself moves or pulls too much, rather than a sensor, a clock or the specimen.
    """

    quantity: str
    value: float
    limit: float
    unit: str
    sample: int
    of_table: bool = False

    def __str__(self) -> str:
        return f"{self.quantity} {self.value:.4g} {self.unit} exceeds {self.limit:.4g} {self.unit}"
