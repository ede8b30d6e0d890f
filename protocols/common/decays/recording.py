"""Recording of the decays of one frame: search for the drive level, then recording, fit and result of each decay.

A decay that cannot be used is repeated once; if the repetition cannot be used either, it is omitted.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.decay import Decay, Setting, pulsed_decay
from bench.analysis.free_decay.stretch import Unusable
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, Publish, RampOut, Step
from bench.events import Event, PointFinished, Progress, StepStarted, Warned
from bench.preflight.margins import bounds
from bench.preflight.motion import laser_demands, table_demands
from protocols.common.calibrate import PROBE, Unmeasurable
from protocols.common.decays.findings import fit_finished, mass_covariance
from protocols.common.decays.frame import FrameResult, decay_point, frame_result
from protocols.common.decays.parameters import DecayParameters
from protocols.common.decays.pulse import LEAST, QUIET, SHARE, PlannedPulse, Pulse
from sim.parameters import Parameters

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each recording, during which the signals are zeroed [s]."""

STILL = 5e-5
"""Standard deviation of u1 and the drift up to which the storeys are considered at rest [m]."""

WAITING = 45.0
"""Expected time of a recording in addition to the duration of its drive [s]: settling of the storeys, rest and ramp."""

DETECTABLE = 20.0
"""Minimum ratio of the drift in a probe to the noise."""

GROWTH, NEAR = 10.0, 2.0
"""Largest growth factor of the drive between probes, and required growth factor below which a probe is the last."""

_PROBED = 3.0
"""Time after the pulse of a probe within which the largest motion is expected [s]."""

_MOST = 6
"""Largest number of probes."""


@dataclass
class Pace:
    """Progress of a run: its `expected` duration [s] and the `elapsed` time [s]."""

    expected: float
    elapsed: float = 0.0

    def progress(self, activity: str) -> Progress:
        return Progress(self.elapsed / self.expected, self.expected - self.elapsed, activity)

    def finish(self, begun: float, planned: float) -> None:
        """Register the end of a part of the run, expected to last `planned` [s], that began when `begun` [s] had
        elapsed.

        Its actual duration, which depends on the number of probes and repetitions, replaces the expected one.
        """
        self.expected += self.elapsed - begun - planned

    def watch(self, sample_rate: float, activity: str) -> Callable[[Array], Event]:
        """Callback that computes the progress from each block of signals."""
        since = 0

        def progress(signals: Array) -> Event:
            nonlocal since
            since += len(signals)
            elapsed = min(self.elapsed + since / sample_rate, self.expected)
            return Progress(elapsed / self.expected, self.expected - elapsed, activity)

        return progress


AT_REST = Arm(REST, STILL)
"""Arming of a recording that begins with the storeys at rest."""

BY_HAND = Arm(REST, still=2e-3, patience=REST)
"""Arming of a recording that begins with a storey held by a hand, which is never still; the fit determines the offsets
of the lasers.
"""


def record(
    volts: Array, sample_rate: float, pace: Pace, activity: str, arming: Arm = AT_REST
) -> Generator[Step, Outcome, Array]:
    """Arm, play and ramp out. Returns the signals, shape (n, 6). Raises Unmeasurable if a fall is detected."""
    yield arming
    outcome = yield Play(volts, pace.watch(sample_rate, activity))
    end = yield RampOut(fast=isinstance(outcome, Fallen))
    pace.elapsed += volts.size / sample_rate + WAITING
    pace.expected = max(pace.expected, pace.elapsed)
    if not isinstance(outcome, Played) or isinstance(end, Fallen):
        raise Unmeasurable("storey 1 has a permanent offset: check the frame, the clamps of the block, and laser 1")
    return outcome.signals


def find_level(
    pulse: Pulse, drift: float, configuration: BenchConfiguration, pace: Pace
) -> Generator[Step, Outcome, float]:
    """Find the peak drive [V] of the pulse that causes a peak drift of `drift` [m], or the largest drift that the
    limits allow.

    Raises Unmeasurable if the frame does not respond, if the limits allow less than `LEAST`, or if the drift is not
    reached after `_MOST` probes.
    """
    volts, seen, limit = PROBE, 0.0, _largest_drive(pulse, configuration)
    for probe in range(1, _MOST + 1):
        yield Publish(StepStarted(f"probe {probe}: a pulse of {volts:.3g} V"))
        signals = yield from record(pulse.record(volts, _PROBED), pulse.sample_rate, pace, "pulse probe")
        rest = round(QUIET * pulse.sample_rate)
        seen, noise = _peak(signals[:, DRIFT]), float(np.nanstd(signals[:rest, DRIFT]))
        if not seen > DETECTABLE * noise:
            if volts >= GROWTH * PROBE:
                raise Unmeasurable(
                    f"the frame does not respond to a pulse of {volts:.2g} V: {1e3 * seen:.2g} mm of drift, noise"
                    f" {1e3 * noise:.2g} mm; check the amplifier, the enable line, the emergency stop and the lasers"
                )
            volts *= GROWTH
            continue
        room, binds = _headroom(signals, pulse.sample_rate, configuration)
        if limit / volts < room:
            room, binds = limit / volts, "the drive limit"
        left = min(drift / seen, room)
        if left < NEAR:
            return (yield from _accept(left * volts, left * seen, drift, binds))
        volts *= min(GROWTH, left)
    raise Unmeasurable(
        f"after {_MOST} probes the drift is {1e3 * seen:.2g} mm, but {1e3 * drift:.2g} mm is required: check "
        "the amplifier's gain and the guides of the table"
    )


def _accept(volts: float, seen: float, drift: float, binds: str) -> Generator[Step, Outcome, float]:
    if seen < LEAST:
        raise Unmeasurable(
            f"{binds} allows a drift of only {1e3 * seen:.2g} mm, but a decay needs {1e3 * LEAST:g} mm: raise the "
            "limit, or choose another --pulse"
        )
    if seen < 0.9 * drift:
        yield Publish(
            Warned(f"{binds} allows a drift of only {1e3 * seen:.2g} mm, but {1e3 * drift:.2g} mm is requested")
        )
    return volts


def _headroom(signals: Array, sample_rate: float, configuration: BenchConfiguration) -> tuple[float, str]:
    """Factor by which a motion may be scaled before it reaches `SHARE` of a limit, and the name of that limit."""
    # average over 20 ms: differences of single samples are dominated by noise
    many = max(round(0.02 * sample_rate), 1)
    rows = len(signals) // many
    smooth = signals[: rows * many, DISPLACEMENT].reshape(rows, many).mean(axis=1)
    velocity = _peak(np.diff(smooth)) * sample_rate / many
    storeys = (_peak(signals[:, LASER_1]), _peak(signals[:, LASER_2]), _peak(signals[:, DRIFT]))
    asked = laser_demands(*storeys, configuration.laser_half_ranges) | table_demands(
        _peak(signals[:, DISPLACEMENT]), velocity, _peak(signals[:, ACCELERATION]), configuration.shaker_model
    )
    limits = bounds(configuration)
    binds = max(asked, key=lambda name: asked[name] / limits[name].limit)
    return SHARE / (asked[binds] / limits[binds].limit), limits[binds].owner


def _largest_drive(pulse: Pulse, configuration: BenchConfiguration) -> float:
    """Peak [V] of the pulse at `SHARE` of the limits of the drive."""
    limits = configuration.limits
    slew = float(np.abs(np.diff(pulse.shape)).max()) * pulse.sample_rate
    return SHARE * min(limits.drive_voltage, limits.drive_slew / slew)


def _peak(values: Array) -> float:
    return float(np.nanmax(np.abs(values)))


PointMaker = Callable[[FrameResult, int], Parameters]
"""Creates the point of a result from the result and the number of the decay, 0 for all decays together."""

PROBES = 3
"""Typical number of probes, used for the expected duration."""

_TRIES = 2
"""Maximum number of attempts at a decay."""


def pulsed_decays(
    parameters: DecayParameters,
    configuration: BenchConfiguration,
    planned: PlannedPulse,
    setting: Setting,
    pace: Pace,
    name: str,
    point: PointMaker = decay_point,
) -> Generator[Step, Outcome, list[Decay]]:
    """Find the drive level, then record the decays; `point` creates the point of each decay.

    Raises Unmeasurable if no decay is usable.
    """
    yield Publish(StepStarted(f"{name}: {1e3 * planned.drift:.3g} mm of drift, {_reason(planned)}"))
    pulse = planned.pulse
    begun = pace.elapsed
    volts = yield from find_level(pulse, planned.drift, configuration, pace)
    pace.finish(begun, _probing_duration(pulse))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        signals = yield from record(pulse.record(volts), pulse.sample_rate, pace, activity)
        return pulsed_decay(signals, setting, QUIET, pulse.begin)

    how = f"a pulse of {volts:.3g} V, recorded for {pulse.length:.0f} s"
    length = pulse.length + WAITING
    return (yield from repeat_decays(parameters, setting, pace, length, once, name, how, point))


def repeat_decays(
    parameters: DecayParameters,
    setting: Setting,
    pace: Pace,
    planned: float,
    once: Callable[[str], Generator[Step, Outcome, Decay]],
    name: str,
    how: str,
    point: PointMaker = decay_point,
) -> Generator[Step, Outcome, list[Decay]]:
    """Record decays with `once`, in at most two attempts each, and publish the fit and the point of each.

    `planned` is the expected time of one decay [s], `name` and `how` describe the excitation. Raises Unmeasurable if no
    decay is usable.
    """
    decays: list[Decay] = []
    for number in range(1, parameters.repeats + 1):
        begun = pace.elapsed
        for attempt in range(_TRIES):
            yield Publish(StepStarted(f"{name} {number} of {parameters.repeats}: {how}"))
            try:
                decay = yield from once(f"{name} {number} of {parameters.repeats}")
            except Unusable as refusal:
                again = "the decay is repeated" if attempt + 1 < _TRIES else "the decay is omitted"
                yield Publish(Warned(f"{name} {number}: {refusal}; {again}"))
                continue
            decays.append(decay)
            yield Publish(fit_finished(decay, f"{name} {number}"))
            yield Publish(
                PointFinished(point(frame_result([decay], setting.masses, setting.masses_covariance), number))
            )
            break
        pace.finish(begun, planned)
        yield Publish(pace.progress(f"finished {name} {number} of {parameters.repeats}"))
    if not decays:
        raise Unmeasurable("no decay was usable: see the warnings of this run for the reasons")
    return decays


def fit_setting(parameters: DecayParameters, configuration: BenchConfiguration) -> Setting:
    """Known values for the fit of a decay, including the covariance of the masses."""
    frame = configuration.known_specimen.frame
    return Setting(
        sample_rate=configuration.sample_rate,
        sensors=configuration.sensors,
        on_table=configuration.laser_reference == "table",
        masses=(frame.m1, frame.m2),
        masses_covariance=mass_covariance(parameters, configuration.identified),
    )


def pulsed_duration(parameters: DecayParameters, pulse: Pulse) -> float:
    """Expected duration of the probes and of all decays [s]."""
    return _probing_duration(pulse) + parameters.repeats * (pulse.length + WAITING)


def _probing_duration(pulse: Pulse) -> float:
    """Expected duration of the probes [s]."""
    return PROBES * (pulse.begin + WAITING)


def _reason(planned: PlannedPulse) -> str:
    return "as requested" if planned.binds == "requested drift" else f"limited by {planned.binds}"
