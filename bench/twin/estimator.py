"""The twin of one run: blocks of samples in, estimates out. It knows of no thread and of no event but its own."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.events import TwinEstimate
from bench.twin.ensemble import Candidates, Ensemble
from bench.twin.gains import Gains, Measured
from bench.twin.resampling import Resampler
from bench.twin.residual import Residual
from sim.errors import RockbenchError

Array = NDArray[np.float64]

_TRACE = 0.01
"""Time between two rows of a trace [s]."""


@dataclass(frozen=True)
class Setting:
    """What the twin of a run needs to know of the bench.

    `on_ground`: the lasers see the table's displacement too. `lag` is theirs behind the
    table's accelerometer and displacement sensor [s], `linearity` their largest error [m], that of storey 1 first.
    """

    sample_rate: float
    on_ground: bool
    lag: tuple[float, float]
    linearity: tuple[float, float]


class Blind(RockbenchError):
    """Without every sample of the table's acceleration there is no model."""

    error_code = "no_estimate"


class Estimator:
    """It begins at rest, with the first block that it is given, and takes every one from there on."""

    def __init__(self, run: int, setting: Setting, those: Candidates) -> None:
        self._run, self._setting = run, setting
        # the model gets the acceleration as late as the lasers show what came of it
        lasers = max(0.0, *(-lag for lag in setting.lag))
        self._resampler = Resampler(setting.sample_rate, (*(lasers + lag for lag in setting.lag), lasers, lasers))
        dt = self._resampler.dt
        self._latency = self._resampler.latency + lasers
        self._ensemble, self._gains = Ensemble(those, dt), Gains(those, dt)
        first, second = setting.linearity
        self._doubts = np.array([first, second, np.hypot(first, second)])
        self._residual = Residual(dt, float(self._doubts[2]))
        self._peaks = np.zeros(len(those.specimens))
        self._measured_peak = 0.0
        self._every, self._skip = max(round(_TRACE / dt), 1), 0

    @property
    def members(self) -> int:
        """How many candidates there are besides the nominal one."""
        return len(self._ensemble) - 1

    def shed(self) -> None:
        """Go on with half of the members; their band holds less."""
        self._ensemble.keep(1 + self.members // 2)

    def take(self, time: float, end: int, signals: Array, measured: Measured | None) -> TwinEstimate | None:
        """The estimate at the end of a block that was read at `time`; None of one too short for a sample of the model.

        `signals`, shape (n, n_signals), are those of the block before sample `end` of the run.

        Raises Blind where the table's acceleration is missing.
        """
        setting = self._setting
        samples, newer = self._resampler.push(signals[:, [ACCELERATION, DISPLACEMENT, LASER_1, LASER_2]])
        if not np.isfinite(samples[:, 0]).all():
            raise Blind("samples of the table's acceleration are missing")
        if not len(samples):
            return None
        acceleration, x, laser_1, laser_2 = np.ascontiguousarray(samples.T)
        u1 = laser_1 - x if setting.on_ground else laser_1
        seen = np.stack((u1, u1 + laser_2 - laser_1, laser_2 - laser_1))
        motions = self._ensemble.feed(acceleration)
        u = np.stack((motions[0], motions[1], motions[1] - motions[0]))
        seconds = (end - 1 - newer) / setting.sample_rate - self._latency
        return self._estimate(time, seconds, acceleration, seen, u, motions[2], measured)

    def _estimate(
        self,
        time: float,
        seconds: float,
        acceleration: Array,
        seen: Array,
        u: Array,
        theta: Array,
        measured: Measured | None,
    ) -> TwinEstimate:
        """From u1, u2 and drift, `seen` of shape (3, n) and of the models of shape (3, k, n), and theta, (k, n)."""
        low, high = _band(u.swapaxes(0, 1), self._doubts[:, None])
        residual, excess = self._residual.push(seen[2], u[2, 0], low[2], high[2])
        alphas = self._gains.push(acceleration, u[2], measured)
        self._peaks = np.maximum(self._peaks[: u.shape[1]], np.abs(u[2]).max(axis=1))
        self._measured_peak = float(np.fmax.reduce(np.abs(seen[2]), initial=self._measured_peak))
        stated = np.nan if measured is None else measured.alpha_2
        values: dict[str, float] = {}
        for k, name in enumerate(("u1", "u2", "drift")):
            values |= _beside(name, u[k, 0, -1], low[k, -1], high[k, -1], seen[k, -1])
        values |= _beside("drift_peak", self._peaks[0], *_band(self._peaks, self._doubts[2]), self._measured_peak)
        values |= _beside("alpha_2", alphas[0], *_band(alphas, 0.0), stated)
        return TwinEstimate(
            time=time,
            run=self._run,
            seconds=seconds,
            members=self.members,
            standing=float(np.isfinite(theta[:, -1]).mean()),
            theta=float(theta[0, -1]),
            residual=residual,
            excess=excess,
            trace=self._trace(seconds, u, theta, low[2], high[2]),
            **values,
        )

    def _trace(self, seconds: float, u: Array, theta: Array, low: Array, high: Array) -> Array:
        """Columns `bench.events.TWIN_TRACE`."""
        n = low.size
        rows = np.arange(self._skip, n, self._every)
        self._skip = (self._skip - n) % self._every
        moments: Array = seconds + self._resampler.dt * (rows - (n - 1)).astype(np.float64)
        trace: Array = np.column_stack((moments, u[0, 0, rows], u[1, 0, rows], theta[0, rows], low[rows], high[rows]))
        return trace


def _band(values: Array, doubt: float | Array) -> tuple[Array, Array]:
    """Least and largest of the candidates that stand, along the first axis, and as much wider as the sensors' `doubt`;
    NaN where fewer than half of them stand.
    """
    few = 2 * np.count_nonzero(np.isfinite(values), axis=0) < len(values)
    low, high = np.fmin.reduce(values, axis=0) - doubt, np.fmax.reduce(values, axis=0) + doubt
    return np.where(few, np.nan, low), np.where(few, np.nan, high)


def _beside(name: str, model: Any, low: Any, high: Any, measured: Any) -> dict[str, float]:
    """The fields of an estimate for one quantity."""
    values = {name: model, f"{name}_low": low, f"{name}_high": high, f"{name}_measured": measured}
    return {key: float(value) for key, value in values.items()}
