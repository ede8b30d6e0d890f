"""Recording of decays: progress of the run, the drive played from rest, and the search for its level."""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, RampOut, Say, Step
from bench.events import Event, Progress, StepStarted, Warned
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.common.decays.pulse import LEAST, QUIET, SHARE, Pulse

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each pulse, over which the zero of the signals is taken [s]."""

STILL = 5e-5
"""Scatter of the storeys at rest below which they are still [m]; a laser's steps stay below."""

WAITING = 45.0
"""Expected time of a recording besides its drive: until the storeys are still, rest, ramp [s]."""

DETECTABLE = 20.0
"""Least ratio of the drift in a probe to its noise."""

GROWTH, NEAR = 10.0, 2.0
"""Most by which the drive grows from one probe to the next; a probe is the last when less than the other is left."""

_PROBED = 3.0
"""Time after a probe's pulse in which the largest motion comes [s]."""

_MOST = 6
"""Largest number of probes."""


@dataclass
class Pace:
    """Progress of a run: `expected` duration [s] of the whole, `elapsed` [s] of it."""

    expected: float
    elapsed: float = 0.0

    def progress(self, activity: str) -> Progress:
        """The progress now."""
        return Progress(self.elapsed / self.expected, self.expected - self.elapsed, activity)

    def finish(self, begun: float, planned: float) -> None:
        """End a part for which `planned` [s] were expected, and which began when `begun` [s] had elapsed.

        The time that it really took, with more probes or fewer, or a repetition, is expected in its place.
        """
        self.expected += self.elapsed - begun - planned

    def watch(self, sample_rate: float, activity: str) -> Callable[[Array], Event]:
        """Makes the progress from each block of signals."""
        since = 0

        def progress(signals: Array) -> Event:
            nonlocal since
            since += len(signals)
            elapsed = min(self.elapsed + since / sample_rate, self.expected)
            return Progress(elapsed / self.expected, self.expected - elapsed, activity)

        return progress


def record(volts: Array, sample_rate: float, pace: Pace, activity: str) -> Generator[Step, Outcome, Array]:
    """Arm, play and ramp out; the signals, shape (n, 6). Raises Unmeasurable when something fell."""
    yield Arm(REST, STILL)
    outcome = yield Play(volts, pace.watch(sample_rate, activity))
    end = yield RampOut(fast=isinstance(outcome, Fallen))
    pace.elapsed += volts.size / sample_rate + WAITING
    pace.expected = max(pace.expected, pace.elapsed)
    if not isinstance(outcome, Played) or isinstance(end, Fallen):
        raise Unmeasurable(
            "storey 1 has moved aside for good: see to the frame, to what holds the block, and to laser 1"
        )
    return outcome.signals


def find_level(
    pulse: Pulse, drift: float, configuration: BenchConfiguration, pace: Pace
) -> Generator[Step, Outcome, float]:
    """The drive [V] with which the pulse makes a peak of `drift` [m], or as much as the limits allow.

    Raises Unmeasurable when the frame does not respond, or its drift does not reach `LEAST`.
    """
    volts, seen, limit = PROBE, 0.0, _largest_drive(pulse, configuration)
    for probe in range(1, _MOST + 1):
        yield Say(StepStarted(f"probe {probe}: a pulse of {volts:.3g} V"))
        signals = yield from record(pulse.record(volts, _PROBED), pulse.sample_rate, pace, "the pulse is probed")
        rest = round(QUIET * pulse.sample_rate)
        seen, noise = _peak(signals[:, DRIFT]), float(np.nanstd(signals[:rest, DRIFT]))
        if not seen > DETECTABLE * noise:
            if volts >= GROWTH * PROBE:
                raise Unmeasurable(
                    f"the frame does not answer a pulse of {volts:.2g} V: {1e3 * seen:.2g} mm of drift, noise"
                    f" {1e3 * noise:.2g} mm; see to the amplifier, the enable line, the emergency stop and the lasers"
                )
            volts *= GROWTH
            continue
        room, binds = _headroom(signals, pulse.sample_rate, configuration)
        if limit / volts < room:
            room, binds = limit / volts, "limits of the drive"
        left = min(drift / seen, room)
        if left < NEAR:
            return (yield from _accept(left * volts, left * seen, drift, binds))
        volts *= min(GROWTH, left)
    raise Unmeasurable(
        f"after {_MOST} probes the drift comes to {1e3 * seen:.2g} mm where {1e3 * drift:.2g} mm are asked for: see to"
        " the amplifier's gain and to what holds the table"
    )


def _accept(volts: float, seen: float, drift: float, binds: str) -> Generator[Step, Outcome, float]:
    if seen < LEAST:
        raise Unmeasurable(
            f"{binds} leaves {1e3 * seen:.2g} mm of drift, a decay needs {1e3 * LEAST:g} mm: raise the limit, or give"
            " another --pulse"
        )
    if seen < 0.9 * drift:
        yield Say(Warned(f"{binds} leaves {1e3 * seen:.2g} mm of drift, {1e3 * drift:.2g} mm are asked for"))
    return volts


def _headroom(signals: Array, sample_rate: float, configuration: BenchConfiguration) -> tuple[float, str]:
    """By how much a motion may grow until it takes `SHARE` of a limit, and which that is."""
    limits, halves = configuration.limits, [0.5 * whole for whole in configuration.laser_ranges]
    acceleration, displacement = _peak(signals[:, ACCELERATION]), _peak(signals[:, DISPLACEMENT])
    # the mean over some milliseconds: the difference of single samples is noise
    many = max(round(0.02 * sample_rate), 1)
    rows = len(signals) // many
    smooth = signals[: rows * many, DISPLACEMENT].reshape(rows, many).mean(axis=1)
    asked = {
        "drift": _peak(signals[:, DRIFT]) / limits.drift,
        "laser_range": max(_peak(signals[:, LASER_1]) / halves[0], _peak(signals[:, LASER_2]) / halves[1])
        / min(limits.laser_range, 1.0),
        "displacement": displacement / min(limits.displacement, configuration.half_stroke),
        "velocity": _peak(np.diff(smooth)) * sample_rate / many / limits.velocity,
        "acceleration": acceleration / limits.acceleration,
    }
    if (mover := configuration.mover) is not None:
        asked["force"] = mover.mass * acceleration / limits.force
        current = (mover.mass * acceleration + mover.stiffness * displacement) / mover.force_constant
        asked["current"] = current / limits.current
    binds = max(asked, key=lambda name: asked[name])
    return SHARE / asked[binds], f"limits.{binds}"


def _largest_drive(pulse: Pulse, configuration: BenchConfiguration) -> float:
    """Peak [V] of the pulse that takes `SHARE` of the limits of the drive."""
    limits = configuration.limits
    slew = float(np.abs(np.diff(pulse.shape)).max()) * pulse.sample_rate
    return SHARE * min(limits.drive_voltage, limits.drive_slew / slew)


def _peak(values: Array) -> float:
    return float(np.nanmax(np.abs(values)))
