"""The only path to the shaker.

The guard owns the rig's output. It refuses commands beyond the limits, checks the measured motion within the
acquisition loop, and ends a run in three ways: *stop* (smooth ramp), *abort* (fast ramp) and *halt* (enable line
cut now). Once a ramp has begun, the factor on the commands can only fall until the guard is armed again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DRIFT, SIGNALS, SignalMap
from bench.guard.conversion import Conversion
from bench.guard.limits import Limits, Ramps, Violation, ramp_refusal
from bench.guard.motion import ChannelLimit, MotionWatch
from bench.guard.quantities import largest
from bench.guard.sensors import SensorWatch, TimeWatch
from bench.guard.shaker import ShakerModel
from drivers.errors import SafetyInputOpen
from drivers.further import FurtherChannel
from drivers.rig import Block, Rig, RigError
from sim.errors import InvalidInput


@dataclass(frozen=True)
class Exchange:
    """One iteration of the acquisition loop.

    `values` are the block's channel values in their units, shape (n, n_channels), `signals` the signals of the
    experiment, shape (n, n_signals; 0 without a signal map), and `drive` [V], shape (n,), the samples played meanwhile.
    `violation` is the exceeded limit, if any. If there are several, a limit that cuts the enable line takes precedence,
    then that of a refused command, then the limit exceeded first. `runaway` is the first exceeded limit that concerns
    the table itself. `warnings` are the limits whose warning level was reached for the first time since arming.
    `opened` names the open safety inputs; if there are any, the enable line has been cut. `magnitudes` returns the
    largest magnitude of each watched quantity in the block, by key, for display.
    """

    block: Block
    values: NDArray[np.float64]
    signals: NDArray[np.float64]
    drive: NDArray[np.float64]
    violation: Violation | None
    warnings: tuple[Violation, ...] = ()
    opened: tuple[str, ...] = ()
    runaway: Violation | None = None
    magnitudes: Callable[[], Mapping[str, float]] = dict[str, float]


class Guard:
    """Check of commands and measured samples, between the engine and the rig.

    A `shaker` model estimates force and current from the motion where no channel measures them. With `signals`, each
    block is converted to signals once, and the guard also checks the drift and those `further` channels that have a
    limit. `laser_ranges` are those of `WatchedQuantities`.
    """

    def __init__(
        self,
        rig: Rig,
        limits: Limits,
        ramps: Ramps,
        shaker: ShakerModel | None = None,
        signals: SignalMap | None = None,
        further: Sequence[FurtherChannel] = (),
        laser_ranges: Sequence[float] | None = None,
    ) -> None:
        self._rig = rig
        self._limits = limits
        self._ramps = ramps
        self._shaker = shaker
        self._signals = signals
        self._further = () if signals is None else _limits_of(signals, further)
        self._first_block = True
        self._channels = rig.channels
        self._conversion = Conversion(rig.channels)
        self._waiting = np.zeros(0)
        self._command = self._sent = 0.0
        self._held: float | None = None
        self._sending = False
        self._owed = self._zeros = 0
        """`_owed`: number of samples that may be queued in the rig in addition to those in `_waiting`. `_zeros`: number
        of samples read since the ramp ended and `_waiting` contained only zeros.
        """
        self._laser_ranges = laser_ranges
        self._make_watches()
        self._warmed = 0.0, 0.0
        """Exponential mean of the squared coil current [A2] at the end of the last armed period, and its time [s]."""
        self._first_read = 0.0, 0
        """Time at which the first block since arming had been read [s], and its number of samples."""
        self._ramp_samples: int | None = None
        self._ramp_done = 0
        self._ramp_from = 1.0
        self._slew = limits.drive_slew / rig.sample_rate
        self._expected = 0
        if (refused := ramp_refusal(limits, ramps)) is not None:
            raise refused

    @property
    def ramping(self) -> bool:
        """Whether the output is being ramped to zero."""
        return self._ramp_samples is not None

    @property
    def at_zero(self) -> bool:
        """Whether a ramp has ended and every sample queued in the rig is zero."""
        return self.ramping and self._gain(0) == 0.0 and not self._waiting.any() and self._zeros > self._owed

    def arm(self) -> None:
        """Arm the rig with samples of 0 V queued. Raises SafetyInputOpen, a RigError, while a safety input is open."""
        if opened := self._opened():
            closing = "close every safety input, then start again"
            raise SafetyInputOpen(f"arming is refused: {', '.join(opened)} open; {closing}", opened)
        if self._expected:
            # the coil is still warm; an attempt to arm that failed has read nothing
            begun, samples = self._first_read
            self._warmed = self._motion.heat, begun + (self._expected - samples) / self._rig.sample_rate
        self._ramp_samples, self._ramp_done, self._ramp_from = None, 0, 1.0
        self._command, self._sent, self._held, self._expected = 0.0, 0.0, None, 0
        self._sending, self._owed, self._zeros = False, 0, 0
        self._first_block = True
        self._make_watches()
        self._waiting = np.zeros(self._rig.lead)
        self._rig.arm()
        self._rig.write(self._waiting)

    def exchange(self, volts: NDArray[np.float64]) -> Exchange:
        """Send a block of commands [V] and read the same number of samples.

        If a command of the block is beyond the limits, none of the block is sent. Instead, the last command of the
        previous block is ramped to zero along the fast ramp.
        """
        if self._sending and self._held is None:
            # the last exchange failed before the guard recorded its block: the commands of that block may not have been
            # sent, and those of this block would then follow with a step
            self._held = self._command
            self._owed = volts.size
        self._sending = True
        refused = self.refusal(volts) if self._held is None else None
        if refused is not None:
            self._held = self._command
            self.abort()
        if self._held is not None:
            volts = np.full(volts.shape, self._held)
        # all memory is allocated before the rig is written to, and the state is updated just after: if memory runs out
        # in any of these lines, the ramp in the next block continues from the value that was really sent
        command, sent = float(volts[-1]), self._ramped(volts)
        last, queue = float(sent[-1]), np.concatenate((self._waiting, sent))
        self._rig.write(sent)
        self._waiting, self._command, self._sent, self._sending = queue, command, last, False
        if self._ramp_samples is not None:
            self._ramp_done += volts.size
        block = self._rig.read(volts.size)
        if block.first != self._expected or len(block) != volts.size:
            expected = f"{self._expected}-{self._expected + volts.size - 1}"
            received = f"{block.first}-{block.first + len(block) - 1}" if len(block) else "none"
            raise RigError(f"samples are missing: expected {expected}, received {received}")
        self._expected += len(block)
        played, self._waiting = queue[: volts.size], queue[volts.size :]
        over = self.ramping and self._gain(0) == 0.0 and not self._waiting.any()
        self._zeros = self._zeros + volts.size if over else 0
        now = self._rig.clock.now()
        if self._expected == len(block):
            self._first_read = now, len(block)
            self._motion.warm(self._remaining_heat())
        values, extremes = self._conversion.of(block.counts)
        signals = self._signals_of(values)
        exceeded, near = self._motion.check(block.first, values, signals, extremes)
        exceeded += self._sensors.check(block.first, block.counts, values, played, extremes)
        exceeded += self._time.check(now, self._expected)
        exceeded.sort(key=lambda violation: (not violation.cuts, violation.sample))
        seen = exceeded[0] if exceeded else None
        if seen is not None:
            self.abort()
        opened = self._opened()
        if opened:
            self._cut_output(opened)
        runaway = next((violation for violation in exceeded if violation.of_table), None)
        return Exchange(
            block,
            values,
            signals,
            played,
            seen if seen is not None and seen.cuts else refused or seen,
            tuple(near),
            opened,
            runaway,
            self._motion.magnitudes,
        )

    def refusal(self, volts: NDArray[np.float64]) -> Violation | None:
        """Limit that commands [V], shape (n,), would exceed if they were sent now, or None."""
        if self._acceptable(volts):
            return None
        if not np.isfinite(volts).all():
            return Violation("drive command", float("nan"), self._limits.drive_voltage, "V", 0)
        peak = float(np.max(np.abs(volts)))
        if peak > self._limits.drive_voltage:
            return Violation("drive command", peak, self._limits.drive_voltage, "V", int(np.argmax(np.abs(volts))))
        change = np.abs(np.diff(volts, prepend=self._command))
        if float(change.max()) > self._slew:
            rate = self._rig.sample_rate
            at = int(np.argmax(change))
            return Violation("drive slew", float(change[at]) * rate, self._limits.drive_slew, "V/s", at)
        return None

    def _acceptable(self, volts: NDArray[np.float64]) -> bool:
        """Whether commands are within the limits; False if one is NaN, because comparisons with NaN are False."""
        first = abs(float(volts[0]) - self._command)
        if not (largest(volts) <= self._limits.drive_voltage and first <= self._slew):
            return False
        change = volts[1:] - volts[:-1]
        return not change.size or largest(change) <= self._slew

    def tare(self, values: NDArray[np.float64], *, drift: bool = True) -> None:
        """Take the mean of values at rest, shape (n, n_channels), as the zero of every signal.

        From then on the drift is checked, unless its zero is unknown or `drift` is False because a laser is aimed
        elsewhere.
        """
        if self._signals is not None:
            self._signals.tare(values)
            self._motion.drift_watched = drift and bool(self._signals.taken[DRIFT])

    def stop(self) -> None:
        """Begin the smooth ramp to zero; a ramp in progress continues."""
        if not self.ramping:
            self._begin(self._ramps.stop)

    def abort(self) -> None:
        """Begin the fast ramp to zero; it replaces a slower ramp in progress, from that ramp's current value."""
        fast = max(round(self._ramps.abort * self._rig.sample_rate), 1)
        if self._ramp_samples is None or self._ramp_samples - self._ramp_done > fast:
            self._begin(self._ramps.abort)

    def halt(self) -> None:
        """Cut the enable line now. Raises RigError if that fails, after stopping the rig instead."""
        try:
            self._rig.halt()
        except RigError as error:
            failed = f"the enable line could not be cut ({error})"
            try:
                self._rig.stop()
            except RigError as another:
                failed = f"{failed}, and the output could not be stopped ({another}): press the emergency stop"
                raise RigError(failed) from another
            raise RigError(f"{failed}; the output was stopped instead: switch the amplifier off") from error

    def disarm(self) -> None:
        """Stop the rig and bring its output to zero."""
        self._rig.stop()

    def _cut_output(self, opened: tuple[str, ...]) -> None:
        try:
            self.halt()
        except RigError as error:
            raise SafetyInputOpen(f"{', '.join(opened)} opened, and {error}", opened) from error

    def _opened(self) -> tuple[str, ...]:
        return tuple(name for name, good in self._rig.interlocks().items() if not good)

    def _make_watches(self) -> None:
        rate = self._rig.sample_rate
        self._motion = MotionWatch(self._channels, rate, self._limits, self._shaker, self._further, self._laser_ranges)
        self._sensors = SensorWatch(self._channels, rate, self._limits)
        self._time = TimeWatch(rate, self._limits)

    def _remaining_heat(self) -> float:
        """Exponential mean of the squared current [A2] at the beginning of the first block.

        The times of later blocks follow from their samples, as in a replay, and the pause counts in whole seconds, so
        that a replay begins with the same value.
        """
        heat, since = self._warmed
        begun, samples = self._first_read
        pause = max(begun - samples / self._rig.sample_rate - since, 0.0)
        return heat * exp(-float(np.floor(pause)) / self._limits.heating_time)

    def _begin(self, duration: float) -> None:
        self._ramp_from = 1.0 if self._ramp_samples is None else float(self._gain(0))
        self._ramp_samples = max(round(duration * self._rig.sample_rate), 1)
        self._ramp_done = 0

    def _gain(self, ahead: int | NDArray[np.int64]) -> float | NDArray[np.float64]:
        """Factor on the command, `ahead` samples from now: half a cosine that falls from the ramp's initial value to
        zero.
        """
        if self._ramp_samples is None:
            return 1.0
        x = np.minimum((self._ramp_done + ahead) / self._ramp_samples, 1.0)
        return np.where(x < 1.0, self._ramp_from * 0.5 * (1.0 + np.cos(np.pi * x)), 0.0)

    def _ramped(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._ramp_samples is not None:
            return self._slewed(volts * self._gain(np.arange(1, volts.size + 1)))
        return volts

    def _slewed(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """`volts` with limited slew: the ramp adds to the slew of the commands, which may already equal the limit."""
        if np.abs(np.diff(volts, prepend=self._sent)).max() <= self._slew:
            return volts
        slowed, last = np.empty_like(volts), self._sent
        for i, target in enumerate(volts):
            last += min(max(target - last, -self._slew), self._slew)
            slowed[i] = last
        return slowed

    def _signals_of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        if self._signals is None:
            return np.empty((len(values), 0))
        if self._first_block:
            # the drive is zero, so the first block gives a provisional zero until the storeys are at rest
            self._signals.tare(values)
            self._first_block = False
        return self._signals.of(values)


def _limits_of(signals: SignalMap, further: Sequence[FurtherChannel]) -> tuple[ChannelLimit, ...]:
    """Limits of further channels. Raises InvalidInput for a channel that the rig does not have."""
    columns = {each.name: len(SIGNALS) + k for k, each in enumerate(signals.further)}
    found: list[ChannelLimit] = []
    for each in further:
        if each.limit is None:
            continue
        if each.name not in columns:
            raise InvalidInput("channels", each.name, "the rig has no such channel, so its limit could not be checked")
        found.append(ChannelLimit(each.name, each.unit, columns[each.name], each.limit, each.warning, each.debounce))
    return tuple(found)
