"""Delays that `rockbench check` measures, on drawn sensors: for `audit`.

The sines of a check follow each other, the frame locked to the table, on one clock of each laser whose rate is off by
up to `coverage_sensors.CLOCK` (rectangular). Against the table's displacement, the accelerometer has no delay, and a
laser has that of its latency and, on average, of half a measurement until it is replaced.
"""

from math import tau

import numpy as np

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from protocols.check.comparison import delay_between, laser_delay
from protocols.check.protocol import CheckParameters
from protocols.common.calibrate import SETTLING
from tests.benchmarks.coverage_sensors import ACCURACY, LEAD, RATE, REST, Motion, Sensors, cycles_of
from tests.benchmarks.estimates import Estimate

ASKED = CheckParameters()
OMEGAS = np.array(sorted(ASKED.omega))


def _motion() -> tuple[Motion, list[slice]]:
    """The sines one after the other, and the samples of each."""
    x, v, a = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    windows, begin = list[slice](), LEAD
    for omega in OMEGAS:
        t = np.arange(round((SETTLING + ASKED.cycles + 1) * tau / omega * RATE)) / RATE
        x.append(ASKED.velocity / omega * np.sin(omega * t))
        v.append(ASKED.velocity * np.cos(omega * t))
        a.append(-ASKED.velocity * omega * np.sin(omega * t))
        windows.append(slice(begin, begin + t.size))
        begin += t.size
    moved = (np.concatenate((np.zeros(LEAD), *each)) for each in (x, v, a))
    return Motion(*moved, *np.zeros((4, begin))), windows


def delays(seed: int) -> dict[str, Estimate]:
    """Delays [s] of accelerometer and laser 1 against the table's displacement, and of laser 2 against laser 1."""
    sensors, (motion, windows) = Sensors(seed), _motion()
    signals = sensors.signals(motion, None)[REST:]
    amplitudes = list[np.ndarray]()
    for omega, window in zip(OMEGAS, windows, strict=True):
        # `cycles_of` leaves the first samples out
        cycles = cycles_of(np.concatenate((np.zeros((REST + LEAD, signals.shape[1])), signals[window])), omega)
        measured = cycles[SETTLING : SETTLING + ASKED.cycles]
        amplitudes.append(np.mean([each.fundamental for each in measured], axis=0))
    columns = np.array(amplitudes).T
    table = delay_between(OMEGAS, columns[DISPLACEMENT], columns[ACCELERATION])
    first, second = (
        laser_delay(OMEGAS, columns[DISPLACEMENT], columns[column], ACCURACY.laser_timing)
        for column in (LASER_1, LASER_2)
    )
    laser = sensors.lasers[0]
    mean = (laser.latency + 0.5) / (laser.rate * (1.0 + laser.clock_error))
    return {
        "accelerometer": Estimate(table.delay, table.uncertainty, 0.0),
        "laser_1": Estimate(first.delay, first.uncertainty, mean),
        "lasers": Estimate(second.delay - first.delay, float(np.hypot(first.uncertainty, second.uncertainty)), 0.0),
    }
