"""Delays that `rockbench check` measures, on drawn sensors: for `audit`.

The sines of a check follow each other, the frame locked to the table, on one clock of each laser whose rate is off by
up to `coverage_sensors.CLOCK` (rectangular). Against the table's displacement, the accelerometer has no delay, and a
laser has that of its latency and, on average, of half a measurement until it is replaced.
"""

from dataclasses import replace
from math import tau

import numpy as np

from bench.analysis.cycles import Cycle
from protocols.check.protocol import CheckParameters
from protocols.check.sines import delay_between, divided, laser_delays
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
    measured = list[tuple[float, list[Cycle]]]()
    for omega, window in zip(OMEGAS, windows, strict=True):
        # `cycles_of` leaves the first samples out
        cycles = cycles_of(np.concatenate((np.zeros((REST + LEAD, signals.shape[1])), signals[window])), omega)
        shown = cycles[SETTLING : SETTLING + ASKED.cycles]
        measured.append((float(omega), [replace(each, first=each.first + window.start) for each in shown]))
    parts, windows = divided(measured, RATE)
    sines = parts.means()
    table = delay_between(OMEGAS, sines.displacement, -sines.acceleration)
    lasers = laser_delays(parts, windows, "displacement", ACCURACY.laser_timing, RATE)
    laser = sensors.lasers[0]
    mean = (laser.latency + 0.5) / (laser.rate * (1.0 + laser.clock_error))
    return {
        "accelerometer": Estimate(table.delay, table.uncertainty, 0.0),
        "laser_1": Estimate(lasers.first.delay, lasers.first.uncertainty, mean),
        "lasers": Estimate(lasers.difference, lasers.uncertainty, 0.0),
    }
