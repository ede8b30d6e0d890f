"""Waveform replication: iterative learning of the drive with which the table follows a record.

A pass plays the drive u and measures the table's acceleration. Its error E is corrected through the inverse of the
table: u <- u + Q IFFT{ W K conj(H) / (|H|^2 + eps^2 max|H|^2) E }, where K contains the coherence and the fraction of E
that is not noise. The iteration converges where |1 - Q H_true / H| < 1. After an accepted pass with a large error, H is
updated from the response measured in that pass. A pass worse than the best one is rolled back. If the best drive was
played only once, it is played again to measure the non-repeatable part; the correction is halved unless the scatter
between the two plays explains the larger error. Thus the accepted error never grows, and little noise or non-repeatable
motion is learned (De Cuyper, Linear feedback control for durability test rigs in the automotive industry, thesis, KU
Leuven 2006).

The iteration has converged when the repeatable error is small enough both as root mean square, over the whole record,
and in the response spectrum, which is sensitive to the few cycles that excite a structure.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bench.control.passes import Envelope, Pass, SpectrumCheck, Verdict, fitting
from bench.control.table_model import TableInverse, TableModel, octave_mean
from bench.control.target import Target
from bench.guard.limits import Limits
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

Status = Literal["running", "converged", "out of passes", "limited"]

_REFINE_ABOVE, _REFINE_ON_ABOVE = 0.05, 0.01
"""Relative error above which refinement of the response starts, and relative error down to which it continues."""
_LEAST_SHARE = 0.02
"""No further pass is made if the limits permit less than this fraction of a correction."""


class ReplicationParameters(Parameters):
    """Parameters of the replication of a record."""

    passes: int = quantity(8, "1", "maximum number of passes", ge=1, le=50)
    tolerance: float = quantity(0.003, "1", "acceptable relative root mean square error, excluding noise", gt=0, lt=1)
    spectrum_tolerance: float = quantity(
        0.01, "1", "acceptable deviation of the response spectrum in excess of noise", gt=0, lt=1
    )
    gains: tuple[float, ...] = quantity(
        (1.0, 1.0, 1.0, 0.7),
        "1",
        "gain Q of each correction, including the first from rest; the last value applies to all later ones",
        min_length=1,
    )
    replay_first: bool = quantity(
        False,
        "",
        "whether the first drive is played twice before its correction, as for a rocking block, whose "
        "motion does not repeat",
    )
    margin: float = quantity(
        1.1, "1", "required ratio of the limits to the largest predicted drive and motion", ge=1, le=3
    )
    beyond: Literal["refuse", "scale"] = quantity(
        "refuse", "", "treatment of a drive or motion beyond a limit over `margin`: refuse it, or scale it down to fit"
    )
    spectrum_band: tuple[float, float] = quantity(
        (0.1, 1.0), "s", "range of periods in which response spectra are compared"
    )
    spectrum_periods: tuple[float, ...] = quantity((), "s", "further periods compared, such as those of the specimen")


class Replication:
    """Replication of `target`. Usage: play `drive` and pass the measurement to `learn`, until `finished`.

    ::

        while not replication.finished:
            acceleration, displacement = ...  # of the table, while replication.drive was played
            report = replication.learn(acceleration, displacement)
        volts = replication.best

    The rig is at rest before each pass; sample i was taken when drive sample i began to act. Raises InvalidInput if
    the model does not cover the target, or when the first drive exceeds a limit and scaling is not allowed.
    """

    def __init__(
        self, target: Target, model: TableModel, limits: Limits, parameters: ReplicationParameters | None = None
    ) -> None:
        self.parameters = p = parameters or ReplicationParameters()
        self._target, self._limits = target, limits
        self._table = TableInverse(model, target)
        self._wanted = self._table.spectrum(target.acceleration)
        self._norm = self._size(np.abs(self._wanted) ** 2)
        if self._norm == 0.0:
            raise InvalidInput("target", "all zero", "it contains no motion to replicate")
        seen = self._table.record(self._table.window * self._wanted)
        self._peak = float(np.abs(seen).max())
        self._spectrum = SpectrumCheck(seen, target.sample_rate, p.spectrum_band, p.spectrum_periods)
        self._noise = self._table.noise
        self._plays = 1
        self._corrections, self._halvings, self._replaying = 0, 0, False
        self._refining = False
        self._passes: list[Pass] = []
        self._least = np.inf
        self._status: Status = "running"
        # before the first pass there is neither drive nor motion, and the error is the entire target
        still = np.zeros(target.acceleration.size)
        self._best, self._missing = still, self._wanted
        self._present = Envelope.of(still, still, still, target.sample_rate)
        self._drive, self._gain, self._verdict = self._next()
        if self._verdict.binds is not None and p.beyond == "refuse":
            raise InvalidInput("target", f"peak {self._peak:.4g} m/s2", str(self._verdict))

    @property
    def drive(self) -> Array:
        """Drive [V] of the next pass, shape (n,); zero at both ends."""
        return self._drive

    @property
    def best(self) -> Array:
        """Drive [V] of the best pass so far, shape (n,)."""
        return self._best

    @property
    def passes(self) -> tuple[Pass, ...]:
        """Every pass so far."""
        return tuple(self._passes)

    @property
    def status(self) -> Status:
        """ "running", or the reason why the passes ended."""
        return self._status

    @property
    def verdict(self) -> Verdict:
        """Effect of the limits on `drive` or, if the status is "limited", on the correction that was not played."""
        return self._verdict

    @property
    def repeatable(self) -> float:
        """Relative root mean square error of the best drive, excluding noise; about 1 before the first pass."""
        power = self._size(np.abs(self._missing) ** 2) ** 2 - self._size(self._noise) ** 2 / self._plays
        return max(power, 0.0) ** 0.5 / self._norm

    @property
    def spectrum_error(self) -> tuple[float, float]:
        """Largest deviation, in excess of noise, of the response spectrum with the best drive, and its period [s].

        A deviation of zero means that noise explains every deviation.
        """
        table = self._table
        seen = table.record(table.window * (self._wanted - self._missing))
        return self._spectrum.clear_error(seen, table.frequency, table.window**2 * self._noise / self._plays)

    @property
    def finished(self) -> bool:
        """Whether the passes have ended."""
        return self._status != "running"

    def learn(self, acceleration: Array, displacement: Array | None = None) -> Pass:
        """Evaluate the pass of `drive`: measured acceleration [m/s2] and displacement [m] of the table, shape (n,).

        The displacement determines the remaining stroke; without it the acceleration is integrated. Raises InvalidInput
        if samples are missing.
        """
        for name, values in (("acceleration", acceleration), ("displacement", displacement)):
            if values is not None and (values.shape != self._drive.shape or not np.isfinite(values).all()):
                raise InvalidInput(f"measured {name}", values.shape, "every sample is required; repeat the pass")
        measured = self._table.spectrum(acceleration)
        missing = self._wanted - measured
        error = self._size(np.abs(missing) ** 2) / self._norm
        accepted, replayed, verdict, gain = error <= self._least, self._replaying, self._verdict, self._gain
        if replayed:
            self._compare(missing)
            if not self._passes[-1].accepted and not self._scatter_explains(self._passes[-1].error):
                self._halvings += 1
        elif accepted:
            self._accept(missing, acceleration, displacement)
            self._refining = error > (_REFINE_ON_ABOVE if self._refining else _REFINE_ABOVE)
            if self._refining:
                self._table.refine(self._drive, measured)
        elif self._plays > 1:
            self._halvings += 1
        self._least = min(error, self._least)
        first = self.parameters.replay_first and not self._passes
        self._replaying = first or (not accepted and not replayed and self._plays == 1)
        report = self._report(error, missing, accepted, replayed, gain, verdict)
        self._passes.append(report)
        self._go_on()
        return report

    def _accept(self, missing: Complex, acceleration: Array, displacement: Array | None) -> None:
        rate = self._target.sample_rate
        self._best, self._missing, self._plays = self._drive, missing, 1
        self._present = Envelope.of(self._drive, acceleration, displacement, rate)

    def _compare(self, missing: Complex) -> None:
        """Update the noise and the mean error with the second play of the best drive."""
        difference = 0.5 * octave_mean(np.abs(missing - self._missing) ** 2, self._table.frequency)
        # two plays may agree by chance: the largest scatter so far is used
        self._noise = np.maximum(self._noise, difference)
        self._missing = 0.5 * (self._missing + missing)
        self._plays = 2

    def _scatter_explains(self, rejected: float) -> bool:
        """Whether a `rejected` error is within the scatter of two plays."""
        repeatable = self._size(np.abs(self._missing) ** 2)
        return (rejected * self._norm) ** 2 <= repeatable**2 + 2.0 * self._size(self._noise) ** 2

    def _report(
        self, error: float, missing: Complex, accepted: bool, replayed: bool, gain: float, verdict: Verdict
    ) -> Pass:
        table = self._table
        return Pass(
            number=len(self._passes) + 1,
            error=error,
            floor=self._size(self._noise) / self._norm,
            peak_error=float(np.abs(table.record(table.window * missing)).max()) / self._peak,
            spectrum_error=self._spectrum.error(table.record(table.window * (self._wanted - missing))),
            accepted=accepted,
            replayed=replayed,
            gain=gain,
            verdict=verdict,
        )

    def _go_on(self) -> None:
        """Decide whether another pass follows, and with which drive."""
        p = self.parameters
        if self.repeatable <= p.tolerance and self.spectrum_error[0] <= p.spectrum_tolerance:
            self._status = "converged"
        elif len(self._passes) >= p.passes:
            self._status = "out of passes"
        elif self._replaying:
            self._drive = self._best
        else:
            self._drive, self._gain, self._verdict = self._next()
            refused = self._verdict.binds is not None and p.beyond == "refuse"
            if refused or self._verdict.share < _LEAST_SHARE:
                self._status = "limited"
            elif np.array_equal(self._drive, self._best):
                # no spectral line has an error above the non-repeatable part
                self._status = "converged"

    def _next(self) -> tuple[Array, float, Verdict]:
        """The best drive with the correction permitted by the limits, the gain, and the effect of the limits."""
        gains, rate = self.parameters.gains, self._target.sample_rate
        gain = gains[min(self._corrections, len(gains) - 1)] * 0.5**self._halvings
        self._corrections += 1
        step = gain * self._table.correction(self._missing, self._noise / self._plays) * self._ends()
        change = Envelope.of(step, self._table.predicted(step), None, rate)
        verdict = fitting(self._present, change, self._limits, self.parameters.margin)
        return self._best + verdict.share * step, gain, verdict

    def _ends(self) -> Array:
        """Factor that ramps a correction of the drive up from zero in the rest before the record, and down to zero in
        the rest after it.
        """
        n = max(self._target.rest // 4, 2)
        ramp = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))
        ends = np.ones(self._target.acceleration.size)
        ends[:n], ends[-n:] = ramp, ramp[::-1]
        return ends

    def _size(self, power: Array) -> float:
        """Square root of the total of `power`, shape (n_lines,), filtered by the window."""
        return float(np.sqrt(np.sum(self._table.window**2 * power)))
