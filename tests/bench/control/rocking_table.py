"""A rocking block on a simulated table, one cycle of a controlled drive at a time, with exact or noisy coefficients."""

from dataclasses import dataclass
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.control.cycle_identification import Control
from bench.control.stabiliser import BLEND
from sim.arrangement import plant_of
from sim.cycle_map import OBSERVED, CycleMap, coefficients, cycle_map
from sim.kernel import table
from sim.kernel.plant import FALLEN, ROCK_A, ROCK_B
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from sim.table_orbit import SUBSTEPS, TICKS, table_orbit

AMPLITUDE = 1.01 * Specimen().uplift_acceleration
HARMONICS = 10


def assumed_map(beta: float, omega: float) -> CycleMap:
    return cycle_map(rocking_orbit(Specimen().coupled(beta), omega, AMPLITUDE), Shaker(), HARMONICS, BLEND)


@dataclass(frozen=True, eq=False)
class Held:
    """Cycles under control: peak of the drift relative to the orbit's, shape (n,), and magnitude of the control."""

    peaks: NDArray[np.float64]
    controls: NDArray[np.float64]
    fell: bool

    @property
    def deviations(self) -> NDArray[np.float64]:
        return np.abs(self.peaks - 1.0)


class RockingTable:
    """The table of `specimen`, driven so that its orbit has the base's sine, with cycles from `phase` [rad] on.

    `answer` is the table's share of the acceleration per share of control asked for.
    """

    def __init__(
        self, specimen: Specimen, omega: float, phase: float, shaker: Shaker | None = None, answer: complex = 1.0
    ) -> None:
        shaker = shaker or Shaker()
        orbit = table_orbit(rocking_orbit(specimen, omega, AMPLITUDE), shaker, HARMONICS)
        self.orbit = orbit
        self._plant = plant_of(specimen, shaker, 0.35)
        self._tick = tau / omega / TICKS
        middle = (np.arange(TICKS) + 0.5) / TICKS
        orders = np.arange(1, HARMONICS + 1)
        drive = orbit.drive * np.exp(1j * orders * (phase - orbit.phase))
        self._requests = (np.exp(1j * tau * np.outer(middle, orders)) @ drive).real
        volts = shaker.gain * AMPLITUDE / complex(shaker.frequency_response(omega, specimen.mass))
        self._carrier = -1j * answer * volts * np.exp(1j * (phase + tau * middle))
        done = np.minimum(middle / BLEND, 1.0)
        self._blend = done * done * (3.0 - 2.0 * done)
        angles = np.arange(TICKS) * (tau / TICKS)
        self._fourier = 2j / TICKS * np.exp(-1j * np.outer(np.arange(1, OBSERVED + 1), phase + angles))
        self._state, self._carried = orbit.start.copy(), np.zeros(2)
        self._state[6] *= 1.02
        self._mode = ROCK_A if self._state[6] > 0.0 else ROCK_B

    def cycle(self, before: complex, now: complex) -> tuple[NDArray[np.float64], float]:
        """Coefficients and peak drift [m] of the next cycle."""
        change = ((before + (now - before) * self._blend) * self._carrier).real
        samples = np.empty((TICKS, 9))
        requests, still = np.ascontiguousarray(self._requests + change), np.zeros(TICKS)
        self._mode = table.stream(
            self._plant, self._tick, SUBSTEPS, requests, still, self._mode, self._state, self._carried, samples
        )
        u1, drift = samples[:, 2], samples[:, 3] - samples[:, 2]
        return coefficients(self._fourier @ u1, self._fourier @ drift), float(np.abs(drift).max())

    @property
    def fell(self) -> bool:
        return self._mode == FALLEN

    def hold(self, stabiliser: Control, cycles: int, noise: float = 0.0, seed: int = 0) -> Held:
        """Control `cycles` cycles, each correction two cycles after the measured one; `noise` [m] of a coefficient."""
        random, peaks, controls = np.random.default_rng(seed), list[float](), [0j, 0j, 0j]
        for _ in range(cycles):
            y, peak = self.cycle(controls[-3], controls[-2])
            if self.fell:
                break
            peaks.append(peak / self.orbit.drift)
            controls.append(stabiliser.next(y + noise * random.standard_normal(y.size)))
        return Held(np.array(peaks), np.abs(controls[1 : len(peaks) + 1]), self.fell)
