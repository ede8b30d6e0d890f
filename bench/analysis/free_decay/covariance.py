"""Covariance of a fit, by source of uncertainty.

The linearised fit converts an error of a measured signal into a shift of the fitted values (`Fit.moved`). The error is
described differently for each source:

- noise: from the spectra of the residual in sections of the decay (Welch), because neighbouring samples are correlated
(laser resolution, filters), slow motions for longer; each quantity is affected only by the noise at the frequencies
and times that determine it;
- table: the noise of the table's sensor, filtered by the frame's response while a mode rings; the
density of this noise is measured at rest before the motion;
- clock: the lasers' clocks are not synchronised, so that a laser's delay wanders by up to one of its measuring periods;
- linearity: sine waves over the lasers' range, of any phase and typical numbers of periods, mostly absorbed by the
fitted curvature; smaller for calibrated lasers;
- masses: the uncertainty of the weighing;
- timebase: a relative error of the sample clock causes the same relative error of frequencies and dashpots, twice this
error of stiffnesses, and none of damping ratios.

Errors due to noise, table and clock are independent between decays. Those due to linearity, masses and timebase are
common to all decays.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.fit import OFFSETS, Fit
from bench.analysis.free_decay.response import quantities, slopes
from bench.analysis.sensor_uncertainty import SensorUncertainty

Array = NDArray[np.float64]

WAVES = np.arange(0.5, 3.01, 0.5)
"""Numbers of periods of a linearity error within the range of a laser."""

CLOCKS = np.array([5e-6, 1e-5, 2e-5, 5e-5, 1e-4])
"""Assumed relative errors of a laser's clock, which determine how fast the laser's delay wanders."""

PHASES = 8
"""Number of initial phases evaluated for a wandering delay."""


def waves(fit: Fit, sensors: SensorUncertainty) -> Array:
    """Linearity errors [m] of each laser for all numbers of periods and both quadrature components, shape (m, 2, n)."""
    seen = fit.fitted
    errors: list[Array] = []
    for laser in range(2):
        size = sensors.linearity_amplitude(laser, seen[laser] - fit.values[OFFSETS][laser])
        for number in WAVES:
            turn = 2.0 * np.pi * number / sensors.ranges[laser] * seen[laser]
            for shape in (np.sin(turn), np.cos(turn)):
                error = np.zeros_like(seen)
                # the phase is uniformly distributed, so each quadrature component has half the power
                error[laser] = size / np.sqrt(2.0 * WAVES.size) * shape
                errors.append(error)
    return np.array(errors)


def clocks(fit: Fit, wander: float) -> Array:
    """Errors [m] of each laser due to sawtooth delays with a range of `wander` [s], at several rates and phases; shape
    (m, 2, n).
    """
    speed, time = np.gradient(fit.fitted, fit.stretch.step, axis=1), fit.stretch.time
    errors: list[Array] = []
    for laser in range(2):
        for pace in CLOCKS if wander > 0.0 else ():
            for phase in np.arange(PHASES) / PHASES:
                late = wander * ((time * pace / wander + phase) % 1.0 - 0.5)
                error = np.zeros_like(speed)
                error[laser] = speed[laser] * late / np.sqrt(CLOCKS.size * PHASES)
                errors.append(error)
    return np.array(errors).reshape(-1, *speed.shape)


OWN, COMMON = ("noise", "table", "clock"), ("linearity", "masses", "timebase")
"""Sources that are independent between decays, and sources common to all decays."""

_RATES = np.array([2.0, 2.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
"""Exponents with which the sample rate enters the quantities of `response.NAMES`."""

SEGMENT, MOST_SECTIONS = 4.0, 4
"""Duration of the segments for the spectrum of the residual [s], and largest number of sections of a decay, each with
its own spectrum: the rounding errors of fast motions are white, those of slow motions are not.
"""

BESIDE = 0.75
"""Distance from a mode within which the spectrum of the residual is not used [Hz]: there it contains the wander of the
lasers' delays, a source of its own. With the fastest assumed clock, a mode has the largest sidebands 0.4 Hz away. A
decay of one section is too short to tell them from the mode.
"""

BAND = 30.0
"""Upper frequency of the band in which the noise of the table's sensor at rest is evaluated [Hz]."""


@dataclass(frozen=True, eq=False)
class Errors:
    """Description of the errors: uncertainty of the `sensors`, the time [s] until which the section is at rest
    (`quiet`, 0 if it does not begin at rest), and the covariance of the `masses` [kg2], shape (2, 2).
    """

    sensors: SensorUncertainty
    quiet: float
    masses: Array


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Covariances of the quantities of `response.NAMES`, shape (n, n), by contribution.

    `mass_shift`, shape (n, 2), is the sensitivity to the masses, and `time_shift`, shape (n,), is the shift due to one
    standard uncertainty of the timebase.
    """

    parts: dict[str, Array]
    mass_shift: Array
    time_shift: Array

    @property
    def own(self) -> Array:
        """Covariance independent between decays, shape (n, n)."""
        return sum((self.parts[name] for name in OWN), np.zeros_like(self.parts[OWN[0]]))

    @property
    def common(self) -> Array:
        """Covariance common to all decays, shape (n, n)."""
        return sum((self.parts[name] for name in COMMON), np.zeros_like(self.parts[OWN[0]]))


def fit_uncertainty(fit: Fit, errors: Errors) -> Uncertainty:
    """Covariances of the quantities derived from a fit."""
    turn, direct = slopes(fit.constants)
    turn = np.hstack((turn, np.zeros((len(turn), fit.values.size - turn.shape[1]))))
    shift = turn @ -fit.moved(fit.mass_jacobian).T + direct
    parts = {name: turn @ part @ turn.T for name, part in _parts(fit, errors).items()}
    late = errors.sensors.accuracy.timebase * _RATES * quantities(fit.constants)
    shared = {"masses": shift @ errors.masses @ shift.T, "timebase": np.outer(late, late)}
    return Uncertainty(parts | shared, shift, late)


def covariances(fit: Fit, errors: Errors) -> tuple[Array, Array]:
    """Covariances of all values of a linearised fit: the part that is independent between decays, and the common part.
    They include neither masses nor timebase.
    """
    parts = _parts(fit, errors)
    own = sum((parts[name] for name in OWN), np.zeros_like(fit.inverse))
    return own, parts["linearity"]


def _parts(fit: Fit, errors: Errors) -> dict[str, Array]:
    return {
        "noise": _noise(fit),
        "table": _table(fit, errors.quiet),
        "clock": _spread(fit.moved(clocks(fit, errors.sensors.accuracy.laser_timing))),
        "linearity": _spread(fit.moved(waves(fit, errors.sensors))),
    }


def _spread(moved: Array) -> Array:
    """Covariance of the values due to the independent shifts `moved`, shape (m, count)."""
    return moved.T @ moved


def _noise(fit: Fit) -> Array:
    """Contribution of noise: the covariance of each laser's residual, from its spectrum in sections of the decay,
    propagated through the linearised fit.
    """
    from scipy import signal

    welch: Any = signal.welch
    n = fit.stretch.time.size
    length = min(round(SEGMENT / fit.stretch.step), n)
    twice = np.full(n // 2 + 1, 2.0)
    twice[0] = 1.0
    sections = _sections(n, length)
    scores = np.zeros_like(fit.inverse)
    for jacobian, residual in zip(fit.jacobian.transpose(1, 0, 2), fit.residual, strict=True):
        for weight in sections:
            # the spectrum of the samples around the middle, where a section counts most
            found = welch(residual[weight > 0.5], nperseg=length)
            frequency, density = np.asarray(found[0], np.float64), np.asarray(found[1], np.float64)
            left = _noise_passes(frequency, fit, BESIDE if len(sections) > 1 else 0.0)
            # half the one-sided density is the variance of the equivalent white noise
            power = np.interp(np.fft.rfftfreq(n), frequency[left], density[left] / 2.0)
            turned = np.fft.rfft(jacobian * weight)
            scores += ((turned * (twice * power / n)) @ turned.conj().T).real
    return fit.inverse @ scores @ fit.inverse


def _sections(n: int, length: int) -> Array:
    """Weights of overlapping sections, shape (sections, n), whose squares sum to 1. Their middles are at least two
    segments of `length` samples apart; a shorter signal is one section.
    """
    number = min(1 + n // (2 * length), MOST_SECTIONS)
    if number == 1:
        return np.ones((1, n))
    middles = np.linspace(0.0, n - 1.0, number)[:, None]
    apart = np.abs(np.arange(n) - middles) / middles[1]
    return np.sqrt(np.maximum(1.0 - apart, 0.0))


def _noise_passes(frequency: Array, fit: Fit, beside: float) -> NDArray[np.bool_]:
    """Mask of the frequencies (in cycles per sample) at which the residual is noise alone: away from zero and from the
    modes, where the fit absorbs noise, and further than `beside` [Hz] from the modes.
    """
    modes = np.abs(fit.response.poles) * fit.stretch.step / (2.0 * np.pi)
    apart = max(1.5 * frequency[1], beside * fit.stretch.step)
    return (frequency > 0.0) & (np.abs(frequency[:, None] - modes) > apart).all(axis=1)


def _table(fit: Fit, quiet: float) -> Array:
    """Contribution of the table sensor's white noise, which acts through the frame's response; computed by the adjoint
    method.
    """
    rest = fit.stretch.table[fit.stretch.time < quiet]
    if rest.size < 2:
        return np.zeros_like(fit.inverse)
    lines = np.fft.rfftfreq(rest.size, fit.stretch.step)
    power = np.abs(np.fft.rfft(rest - rest.mean())) ** 2 / rest.size
    # only up to `BAND`, because filters and averaging have reduced the noise above it
    variance = float(power[(lines > 0.0) & (lines <= BAND)].mean())
    response = fit.response
    response_to_scores = np.array(
        [
            sum(response.storeys(response.forced(score[storey]))[storey] for storey in range(2))
            for score in fit.jacobian[:, :, ::-1]
        ]
    )
    through = fit.inverse @ response_to_scores
    return variance * through @ through.T
