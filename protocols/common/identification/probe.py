"""The first, careful answers of the table to a multisine: nothing needs to be known of it.

The first drive is too small to do harm. Each answer says what volts the next one may have, at most ten times as much
motion, until the level is reached.
"""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION
from bench.control.identification import line_amplitudes
from bench.control.multisine import waveform
from bench.engine.steps import Fallen, Outcome, Played, Say, Step
from bench.events import StepStarted
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.common.identification.playing import Rules, played
from protocols.common.identification.signal import Complex, Grid, drive_for, seen_peak

GROWTH = 10.0
"""Most by which the table's motion grows from one probe to the next."""

REACHED = 0.95
"""Share of the motion at which a probe is the last."""

AUDIBLE = 2.0
"""How many times its noise the answer must reach."""

_AUDIBLE_BY = 2
"""Probe by which the table must have answered."""

_MOST = 6
"""Probes before a table that answers less than expected is given up."""


def probed_response(motion: Complex, grid: Grid, rules: Rules) -> Generator[Step, Outcome, Complex | Fallen]:
    """The table's response [m/s2/V] at the lines, measured with `motion` [m/s2].

    Raises Unmeasurable when the table does not answer, or when it cannot be brought to the motion.
    """
    short = grid.shortened()
    level, reached = seen_peak(motion, short, rules.knee), 0.0
    # as flat in volts as the motion is in acceleration, until something is known
    drive = motion * (PROBE / _peak(motion, short))
    for probe in range(1, _MOST + 1):
        rules.require_drive(short.record(drive))
        yield Say(StepStarted(f"probe {probe}: {_peak(drive, short):.3g} V"))
        outcome = yield from played(short.record(drive), rules)
        if isinstance(outcome, Fallen):
            return outcome
        volts, moved = (line_amplitudes(short.used(of), short.lines) for of in (outcome.drive, _acceleration(outcome)))
        answer, noise = _answer(moved)
        if not answer > AUDIBLE * noise:
            if probe >= _AUDIBLE_BY:
                raise Unmeasurable(
                    f"the table does not answer a drive of {_peak(drive, short):.2g} V: {answer:.2g} m/s2, noise"
                    f" {noise:.2g}; see to the amplifier, the enable line, the emergency stop and the accelerometer"
                )
            drive = GROWTH * drive
            continue
        response = moved.mean(axis=0) / volts.mean(axis=0)
        reached = seen_peak(moved.mean(axis=0), short, rules.knee)
        if reached >= REACHED * level:
            return response
        drive = drive_for(motion, response, short, rules.knee) * min(1.0, GROWTH * reached / level)
    raise Unmeasurable(
        f"after {_MOST} probes the table moves with {reached:.2g} m/s2 where {level:.2g} are asked for: see to the"
        " amplifier's gain and to what holds the table"
    )


def _acceleration(outcome: Played) -> NDArray[np.float64]:
    return outcome.signals[:, ACCELERATION]


def _answer(moved: Complex) -> tuple[float, float]:
    """Root of the power in the mean of periods of amplitudes, and of the noise in it by what differs between them.

    Without an answer the two are alike, the nearer the more lines there are.
    """
    periods, mean = moved.shape[0], moved.mean(axis=0)
    noise = np.sum(np.abs(moved - mean) ** 2) / (periods * (periods - 1))
    return float(np.sqrt(np.sum(np.abs(mean) ** 2))), float(np.sqrt(noise))


def _peak(spectrum: Complex, grid: Grid) -> float:
    return float(np.abs(waveform(grid.lines, spectrum, grid.samples)).max())
