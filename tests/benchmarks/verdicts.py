"""Predicted stability of drawn benches against long runs of the simulator.

    python -m tests.benchmarks.verdicts [--benches 200] [--first 0]

Each bench has a table of 20 to 200 kg (uniform in the logarithm), a specimen drawn from the assumed uncertainty, and a
frequency in a window in which some benches are stable and some are not. Two verdicts are compared with the growth of a
small disturbance over 300 cycles of a simulation with four times finer steps:

- that of the orbit of the true specimen (`sim.table_orbit`): its modulus is to agree within the stated 4e-5;
- that of a researcher, who knows the table's mass but of the specimen only the assumed one: modulus and expanded
  uncertainty as `rockbench run stability` predicts them. It is wrong if the true modulus is on the other side of 1 and
  beyond the uncertainty.

The disturbance is scaled back every few cycles. A linear map is fitted to its successive states by least squares, and
the growth is that of the map's dominant eigenvalue: the size of the disturbance alone converges slowly where two pairs
of multipliers have nearly the same modulus.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from protocols.stability.prediction import predicted, rocking
from sim.shaker import Shaker
from sim.steady import NoOrbit, Orbit
from sim.table_orbit import SUBSTEPS, TICKS, TablePeriod, corner, table_orbit

Array = NDArray[np.float64]

WINDOWS = ((0.64, 12.2, 14.0), (0.97, 13.3, 15.8))
"""Stiffness ratio, and frequencies [rad/s] between which the boundaries of most benches are."""
MASSES = 20.0, 200.0
HARMONICS = 10
FINER = 2
"""Factor by which both the ticks and the steps in them are finer than those of the orbit."""
SIZE = 1e-4
"""Size of the disturbance, relative to the states."""
BETWEEN, ROUNDS = 5, 60
"""Cycles between two scalings, and number of scalings."""
RESOLVED = 1e-6
"""Smallest part of the disturbances, relative to the largest, that determines the fitted map."""
NUMERICAL = 4e-5
"""Stated error of the modulus."""

CONFIGURATION = BenchConfiguration()
NOMINAL = CONFIGURATION.known_specimen
LEVEL = 1.01 * NOMINAL.uplift_acceleration


@dataclass(frozen=True)
class Verdict:
    """Moduli of the dominant multiplier: of the true specimen's orbit, in a long run, and as predicted with the
    expanded uncertainty.
    """

    orbit: float
    run: float
    predicted: float
    uncertainty: float

    @property
    def wrong(self) -> bool:
        """Whether the prediction is on the other side of 1, beyond its uncertainty."""
        opposite = (self.predicted > 1.0) is not (self.run > 1.0)
        return opposite and abs(self.predicted - self.run) > self.uncertainty


def growth(ground: Orbit, shaker: Shaker) -> float:
    """Growth per cycle of a small disturbance of the orbit on the table, in a simulation with finer steps."""
    coarse = table_orbit(ground, shaker, HARMONICS)
    fine = TablePeriod(ground.specimen, shaker, ground.omega, FINER * TICKS, FINER * SUBSTEPS)
    start = fine.closed(coarse.start, coarse.drive)
    commands, scales = fine.commands(coarse.drive), fine.scales(start)

    def after(y: Array) -> Array:
        y, mode, carried = y.copy(), corner(y), np.array([commands[-1], 0.0])
        for _ in range(BETWEEN):
            mode, _ = fine.advance(mode, y, carried, commands)
        return y

    change = SIZE * scales * np.random.default_rng(1).standard_normal(8)
    before, later = list[Array](), list[Array]()
    for _ in range(ROUNDS):
        # the difference of two disturbances of opposite sign is linear to second order
        moved = 0.5 * (after(start + change) - after(start - change))
        before.append(change / scales)
        later.append(moved / scales)
        change = moved * SIZE / float(np.linalg.norm(moved / scales))
    fitted = (np.linalg.pinv(np.array(before), rcond=RESOLVED) @ np.array(later)).T
    return float(np.abs(np.linalg.eigvals(fitted)).max() ** (1.0 / BETWEEN))


def verdict(seed: int) -> Verdict:
    """The verdicts on a bench. Raises NoOrbit if the true or the assumed specimen has no rocking orbit there."""
    random = np.random.default_rng([seed, 17])
    beta, low, high = WINDOWS[seed % len(WINDOWS)]
    mass = float(np.exp(random.uniform(*np.log(MASSES))))
    omega = float(random.uniform(low, high))
    assumed = NOMINAL.coupled(beta)
    [true] = CONFIGURATION.known.draws(assumed, 1, random)
    shaker = CONFIGURATION.simulation.bench.shaker.model_copy(update={"moving_mass": mass})
    actual, expected = (rocking(specimen, omega, LEVEL) for specimen in (true, assumed))
    if actual is None or expected is None:
        raise NoOrbit("there is no rocking motion")
    foreseen = predicted(expected, CONFIGURATION.known, shaker, HARMONICS)
    return Verdict(
        orbit=abs(table_orbit(actual, shaker, HARMONICS).slowest),
        run=growth(actual, shaker),
        predicted=abs(foreseen.multiplier),
        uncertainty=2.0 * foreseen.uncertainty,
    )


def study() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--benches", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first bench: seeds follow it")
    asked = parser.parse_args()
    found, seed, omitted = list[Verdict](), asked.first, 0
    while len(found) < asked.benches:
        try:
            one = verdict(seed)
        except NoOrbit as error:
            omitted += 1
            print(f"{seed}: omitted: {error}", flush=True)
        else:
            found.append(one)
            told = "WRONG" if one.wrong else ""
            print(
                f"{seed}: run {one.run:.5f}, orbit {one.orbit - one.run:+.1e}, predicted {one.predicted:.4f} +- "
                f"{one.uncertainty:.4f} {told}",
                flush=True,
            )
        seed += 1
    error = np.array([one.orbit - one.run for one in found])
    opposite = sum((one.orbit > 1.0) is not (one.run > 1.0) for one in found)
    covered = np.mean([abs(one.predicted - one.run) <= one.uncertainty for one in found])
    e = np.array([(one.predicted - one.run) / (0.5 * one.uncertainty) for one in found])
    print(
        f"{len(found)} benches, {omitted} omitted, {sum(one.run > 1.0 for one in found)} unstable\n"
        f"orbit: largest error of |mu| {np.abs(error).max():.1e} (stated {NUMERICAL:.0e}), rms "
        f"{np.sqrt(np.mean(error**2)):.1e}; on the other side of 1: {opposite}\n"
        f"predicted from the assumed specimen: wrong beyond U {sum(one.wrong for one in found)}, covered "
        f"{covered:.1%}, rms of e {np.sqrt(np.mean(e**2)):.2f}"
    )


if __name__ == "__main__":
    study()
