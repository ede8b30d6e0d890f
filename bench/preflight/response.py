"""What drive a motion of the table needs: from the simulated shaker, or from a table that has been identified."""

from dataclasses import dataclass
from math import pi, tau
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from sim.shaker import Shaker

Array = NDArray[np.float64]


class TableResponse(Protocol):
    """Acceleration of the table per volt of drive."""

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:
        """Complex response [m/s2/V] at `omega` [rad/s], same shape, with `payload` [kg] on the table."""
        ...

    def gain(self, omega: Array, payload: float) -> Array:
        """Its magnitude."""
        ...

    @property
    def friction(self) -> float:
        """Drive that friction takes besides [V]: the fundamental of a force that changes sign with the velocity."""
        ...


@dataclass(frozen=True)
class SimulatedTable:
    """The shaker of the simulated bench, linear but for its friction, the payload as a rigid mass."""

    shaker: Shaker

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:
        return self.shaker.frequency_response(omega, payload)

    def gain(self, omega: Array, payload: float) -> Array:
        return np.abs(self.transfer(omega, payload))

    @property
    def friction(self) -> float:
        return 4.0 / pi * self.shaker.friction / self.shaker.force_per_volt


@dataclass(frozen=True)
class IdentifiedTable:
    """A table as identified; specimen and friction are in it as they were then."""

    model: TableModel

    def transfer(self, omega: Array, payload: float) -> NDArray[np.complex128]:  # noqa: ARG002
        return self.model.response(omega / tau)

    def gain(self, omega: Array, payload: float) -> Array:
        return np.abs(self.transfer(omega, payload))

    @property
    def friction(self) -> float:
        return 0.0


def response_of(configuration: BenchConfiguration) -> TableResponse | None:
    """What is known of this bench's table; None for a real one that has no stored model.

    Raises InvalidInput when the stored model cannot be read or was identified at another sample rate. Its age does not
    matter here: an old one still tells about how much drive a motion takes.
    """
    if configuration.table_model is not None:
        model = TableModel.read(Path(configuration.table_model))
        model.require_rate(configuration.sample_rate)
        return IdentifiedTable(model)
    if configuration.backend == "simulated":
        return SimulatedTable(configuration.simulation.bench.shaker)
    return None
