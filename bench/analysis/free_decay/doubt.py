"""How uncertain a fit is, part by part.

Every error of what was measured moves the values by the gain of the linearised fit (`Fit.moved`). What differs between
them is how the error is known:

- noise: from the residual itself, whose neighbours are correlated (steps of the lasers, filters): by its spectrum
  (Welch), so that each quantity has the noise of those frequencies that tell it;
- table: the noise of the table's sensor goes through the response of the frame, which keeps it for as long as a mode
  rings; its density is that at rest before the motion;
- clock: the lasers measure at their own pace, so their delay wanders by up to one of their measurements;
- linearity: smooth waves over the lasers' range, of any phase and of the numbers of waves that are usual, of which the
  fitted bend takes the most;
- masses: as weighed;
- timebase: a clock of the samples that is slow or fast by a share takes that share off every rate: once off frequencies
  and dashpots, twice off stiffnesses, not off damping ratios.

Noise, table and clock are new in every decay. Linearity, masses and timebase are the same in all of them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.fit import Fit
from bench.analysis.free_decay.modal import quantities, slopes
from bench.analysis.gain import SensorAccuracy

Array = NDArray[np.float64]

WAVES = np.arange(0.5, 3.01, 0.5)
"""Waves of a linearity error within the range of a laser."""

CLOCKS = np.array([5e-6, 1e-5, 2e-5, 5e-5, 1e-4])
"""Relative errors of a laser's clock: the larger, the sooner a measurement is gained or lost."""

PHASES = 8
"""Phases of such a wander that are looked at."""


def waves(fit: Fit, size: float, ranges: tuple[float, float]) -> Array:
    """Linearity errors of either laser: every number of waves and both quadratures, shape (m, 2, n)."""
    seen = fit.fitted
    errors: list[Array] = []
    # a phase of any size: each quadrature has half the power
    weight = size / np.sqrt(2.0 * WAVES.size)
    for laser in range(2):
        for number in WAVES:
            turn = 2.0 * np.pi * number / ranges[laser] * seen[laser]
            for shape in (np.sin(turn), np.cos(turn)):
                error = np.zeros_like(seen)
                error[laser] = weight * ranges[laser] * shape
                errors.append(error)
    return np.array(errors)


def clocks(fit: Fit, wander: float) -> Array:
    """Delays of either laser that wander like a saw by `wander` [s], at several paces and phases, shape (m, 2, n)."""
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
"""Parts of the doubt: what is new in every decay, and what is common to all."""

_RATES = np.array([2.0, 2.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
"""Powers of a rate in the quantities of `modal.NAMES`."""

SEGMENT = 4.0
"""Length of the segments for the spectrum of the residual [s]."""

BAND = 30.0
"""Up to this frequency the noise of the table's sensor at rest is taken as that in which the modes stand [Hz]."""


@dataclass(frozen=True, eq=False)
class Errors:
    """What is known of the errors: the `accuracy` of the sensors, the lasers' `ranges` [m], the time [s] until which
    the stretch is at rest (`quiet`, 0 where it is not), and the covariance of the `masses` [kg2], shape (2, 2).
    """

    accuracy: SensorAccuracy
    ranges: tuple[float, float]
    quiet: float
    masses: Array


@dataclass(frozen=True, eq=False)
class Doubt:
    """Covariances of the quantities of `modal.NAMES`, shape (n, n), by part.

    `mass_shift`, shape (n, 2), is how the quantities follow the masses; `time_shift`, shape (n,), by how much they are
    moved by a timebase that is off by its standard uncertainty.
    """

    parts: dict[str, Array]
    mass_shift: Array
    time_shift: Array

    @property
    def own(self) -> Array:
        """Of what is new in every decay."""
        return sum((self.parts[name] for name in OWN), np.zeros_like(self.parts[OWN[0]]))

    @property
    def common(self) -> Array:
        """Of what is common to all decays."""
        return sum((self.parts[name] for name in COMMON), np.zeros_like(self.parts[OWN[0]]))


def doubt(fit: Fit, errors: Errors) -> Doubt:
    """The doubt of a fit."""
    turn, direct = slopes(fit.constants)
    turn = np.hstack((turn, np.zeros((len(turn), fit.values.size - turn.shape[1]))))
    shift = turn @ -fit.moved(fit.mass_jacobian).T + direct
    parts = {name: turn @ part @ turn.T for name, part in _parts(fit, errors).items()}
    late = errors.accuracy.timebase * _RATES * quantities(fit.constants)
    shared = {"masses": shift @ errors.masses @ shift.T, "timebase": np.outer(late, late)}
    return Doubt(parts | shared, shift, late)


def covariances(fit: Fit, errors: Errors) -> tuple[Array, Array]:
    """Covariance of all values of a linearised fit: of what is new in every decay, and of what is common to all.

    Neither masses nor timebase are in it.
    """
    parts = _parts(fit, errors)
    own = sum((parts[name] for name in OWN), np.zeros_like(fit.inverse))
    return own, parts["linearity"]


def _parts(fit: Fit, errors: Errors) -> dict[str, Array]:
    return {
        "noise": _noise(fit),
        "table": _table(fit, errors.quiet),
        "clock": _spread(fit.moved(clocks(fit, errors.accuracy.laser_timing))),
        "linearity": _spread(fit.moved(waves(fit, errors.accuracy.laser_linearity, errors.ranges))),
    }


def _spread(moved: Array) -> Array:
    """Covariance of shifts whose squares add up, shape (m, count)."""
    return moved.T @ moved


def _noise(fit: Fit) -> Array:
    """Through the spectrum of the residual of either laser: J R J' with R the covariance that belongs to it."""
    from scipy import signal

    welch: Any = signal.welch
    n = fit.stretch.time.size
    scores = np.zeros_like(fit.inverse)
    for jacobian, residual in zip(fit.jacobian.transpose(1, 0, 2), fit.residual, strict=True):
        length = min(round(SEGMENT / fit.stretch.step), n)
        found = welch(residual, nperseg=length)
        frequency, density = np.asarray(found[0], np.float64), np.asarray(found[1], np.float64)
        turned = np.fft.rfft(jacobian)
        # one-sided density over two is the variance of white noise of this strength
        left = _left_alone(frequency, fit)
        power = np.interp(np.fft.rfftfreq(n), frequency[left], density[left] / 2.0)
        twice = np.full(power.size, 2.0)
        twice[0] = 1.0
        scores += ((turned * (twice * power / n)) @ turned.conj().T).real
    return fit.inverse @ scores @ fit.inverse


def _left_alone(frequency: Array, fit: Fit) -> NDArray[np.bool_]:
    """Lines (in cycles per sample) at which the fit takes no noise along: not those next to a mode, nor the mean."""
    modes = np.abs(fit.response.poles) * fit.stretch.step / (2.0 * np.pi)
    apart = 1.5 * frequency[1]
    return (frequency > 0.0) & (np.abs(frequency[:, None] - modes) > apart).all(axis=1)


def _table(fit: Fit, quiet: float) -> Array:
    """White noise of the table's sensor through the response: by the adjoint, the response to the scores backwards."""
    rest = fit.stretch.table[fit.stretch.time < quiet]
    if rest.size < 2:
        return np.zeros_like(fit.inverse)
    heard_at = np.fft.rfftfreq(rest.size, fit.stretch.step)
    power = np.abs(np.fft.rfft(rest - rest.mean())) ** 2 / rest.size
    # where the modes are; above, filters and means have taken part of the noise
    variance = float(power[(heard_at > 0.0) & (heard_at <= BAND)].mean())
    response = fit.response
    heard = np.array(
        [
            sum(response.storeys(response.forced(score[storey]))[storey] for storey in range(2))
            for score in fit.jacobian[:, :, ::-1]
        ]
    )
    through = fit.inverse @ heard
    return variance * through @ through.T
