"""Acquisition loop and the steps that run in it."""

from collections import Counter
from contextlib import suppress
from math import ceil, tau
from typing import Never

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.fall import FallWatch
from bench.analysis.signals import MEASURED_BY, SIGNALS, scatter
from bench.control.oscillator import sweeps
from bench.engine.interface import Ended, Ending, EventStream, Requests
from bench.engine.output import Output
from bench.engine.stalls import in_words
from bench.engine.steps import (
    AcquireAtRest,
    Arm,
    Done,
    Dwell,
    Fallen,
    Measured,
    Outcome,
    Play,
    Played,
    RestSamples,
    Scheduled,
    SetHarmonics,
    Sweep,
)
from bench.events import LimitExceeded, State, Warned
from bench.guard.guard import Exchange, Guard
from bench.guard.limits import Violation, amount
from bench.plugins import plugin_code
from drivers.errors import EnableLineCut
from drivers.rig import Alignment, Counts, Rig, RigError
from sim.errors import UNKNOWN, Cause, CauseCode, InvalidInput, RockbenchError
from sim.specimen import Specimen

_STATUS = {"halt": "halted", "abort": "aborted", "stop": "stopped"}
"""Status of a run that a request ends while the rig is being armed."""


class Loop:
    """Acquisition loop, which exchanges blocks until a request or an exceeded limit ends the run. `Ended` is then
    raised, with the output at zero.
    """

    def __init__(self, output: Output, guard: Guard, stream: EventStream, requests: Requests) -> None:
        self.output = output
        self._guard, self._stream, self._requests = guard, stream, requests
        self.latest: Counts | None = None
        """Counts of the last block."""
        self.fall: FallWatch | None = None
        """Detector of the fall of the mounted block; None if no specimen is mounted."""
        self._over: Violation | None = None
        self._runaway: Violation | None = None

    def begin(self, reason: str) -> None:
        """Arm the rig with samples of 0 V queued. A request while it is being armed ends the run with the enable line
        cut, because the drive is zero and somebody may be at the table.
        """
        self._over = self._runaway = None
        self.check_requests()
        failed: RigError | None = None
        try:
            with self._requests.arming():
                if not self._requests.forbids_arming:
                    self.output.arm(reason)
        except RigError as error:
            if not self._requests.forbids_arming:
                raise
            # a rig whose enable line was cut refuses to be armed; any other error is told too
            failed = None if str(error) == EnableLineCut.text else error
        asked = self._requests.strongest
        if asked is not None and self._requests.forbids_arming and self.output.driven:
            ending = Ending(_STATUS[asked], self._requests.reason, self._requests.cause)
            raise Ended(self.output.cut(ending if failed is None else ending.then(Ending.failed(failed))))
        self.check_requests()

    def exchange(self) -> Exchange:
        """Run one iteration: exchange a block, publish its warnings, check its limits and the requests."""
        exchange = self.output.exchange()
        for near in exchange.warnings:
            self._stream.publish(
                Warned(f"{near.quantity} {amount(near.value, near.unit)} approaches its limit {near.limit:.4g}")
            )
        self._runaway = exchange.runaway
        if exchange.violation is not None and exchange.violation.cuts:
            self._cut(exchange.violation)
        if exchange.violation is not None and self._over is None:
            self._exceeded(exchange.violation)
        self.check_requests()
        return exchange

    def signals(self) -> tuple[NDArray[np.float64], bool]:
        """Run one iteration. Returns signals, shape (block, len(SIGNALS)), and whether the rocking block has fallen."""
        # only the standard signals: missing samples of an additional channel must not invalidate the plan's cycles
        exchange = self.exchange()
        self.latest = exchange.block.counts
        signals = exchange.signals[:, : len(SIGNALS)]
        return signals, self.fall is not None and self.fall.fallen(signals)

    def check_requests(self) -> None:
        """End the run if a request is pending."""
        asked, why, cause = self._requests.strongest, self._requests.reason, self._requests.cause
        state = self.output.state
        if asked == "halt":
            raise Ended(self.output.cut(Ending("halted", why, cause)))
        if asked == "abort" and state is not State.ABORTING:
            self._end(State.ABORTING, Ending("aborted", why, cause))
        if asked == "stop" and state not in (State.ABORTING, State.STOPPING):
            self._end(State.STOPPING, Ending("stopped", why, cause))

    def end_test(self, *, fast: bool) -> bool:
        """Ramp out at the end of a test. Returns whether the block fell; an exceeded limit ends the run."""
        fell = self.ramp_out(State.ABORTING if fast else State.STOPPING, "end of the test")
        if self._over is not None:
            raise Ended(Ending("aborted", str(self._over), _cause(self._over)))
        return fell

    def ramp_out(self, way: State, reason: str, cause: Cause = UNKNOWN) -> bool:
        """Ramp the output to zero, fast if `way` is ABORTING, otherwise smoothly, and stop the rig. Returns whether the
        block fell. Halts the bench if the table still exceeds a limit at the end.
        """
        begin = self._guard.abort if way is State.ABORTING else self._guard.stop
        begin()
        if self.output.state is not way:
            self.output.machine.go(way, reason, cause)
        fell = False
        while not self._guard.at_zero:
            fell |= self.signals()[1]
        if self._runaway is not None:
            reason = f"{self._runaway} after the drive was ramped to zero"
            raise Ended(self.output.cut(Ending("halted", reason, _cause(self._runaway))))
        self.output.rest()
        return fell

    def _exceeded(self, over: Violation) -> None:
        """End the run at the first limit exceeded since arming; a fast ramp in progress continues."""
        self._over = over
        self._stream.publish(LimitExceeded(over.quantity, over.value, over.limit, over.unit, over.timing))
        if self.output.state is not State.ABORTING:
            stalled = self.output.stalled if over.timing else 0.0
            reason = f"{over}; {in_words(stalled)}" if stalled else str(over)
            self._end(State.ABORTING, Ending("aborted", reason, _cause(over)))

    def _cut(self, over: Violation) -> Never:
        """Cut the enable line now, even during a ramp, without waiting for the samples queued in the device."""
        self._over = over
        self._stream.publish(LimitExceeded(over.quantity, over.value, over.limit, over.unit, over.timing))
        raise Ended(self.output.cut(Ending("halted", f"{over}: the enable line was cut", _cause(over))))

    def _end(self, way: State, ending: Ending) -> Never:
        if self.output.state is not State.IDLE:
            ending = ending.then(self.output.ending_of(lambda: self.ramp_out(way, ending.reason, ending.cause)))
        raise Ended(ending)


def _cause(over: Violation) -> Cause:
    return Cause(CauseCode.LIMIT, over.quantity)


class AtRest:
    """Steps with the output at zero: arming, taring and acquisition at rest."""

    def __init__(self, loop: Loop, rig: Rig, guard: Guard, stream: EventStream) -> None:
        self._loop, self._rig, self._guard, self._stream = loop, rig, guard, stream
        self.measures_storeys = True
        """Whether the laser of storey 2 is aimed at its storey, so that the difference of the lasers is the drift."""

    def arm(self, step: Arm, specimen: Specimen | None) -> None:
        """Arm, wait until the storeys are still or the patience is exhausted, and tare the signals."""
        self._loop.begin("start of a test")
        rest, still = self._stillness(step)
        self._guard.tare(rest, drift=self.measures_storeys)
        self._loop.fall = FallWatch(specimen, self._rig.sample_rate) if specimen else None
        storeys = "storeys at rest" if still else "storeys still moving"
        self._loop.output.machine.go(State.RUNNING, f"{storeys}, signals tared")

    def acquire(self, step: AcquireAtRest) -> RestSamples:
        """Acquire samples. An exceeded limit ends the acquisition but not the plan, because the table is not driven."""
        output = self._loop.output
        self._loop.begin("acquisition with the output at zero")
        counts: list[Counts] = []
        violation: Violation | None = None
        for _ in range(self._blocks(step.duration)):
            exchange = output.exchange()
            counts.append(exchange.block.counts)
            violation = exchange.violation
            if violation is not None:
                self._guard.halt()
                break
            self._loop.check_requests()
        output.machine.go(
            State.STOPPING, "the acquisition at rest is complete" if violation is None else str(violation)
        )
        alignments: tuple[Alignment, ...] = ()
        # if this fails, `rest` publishes a warning
        with suppress(RockbenchError):
            alignments = self._rig.alignments
        output.rest()
        return RestSamples(self._rig.channels, np.concatenate(counts), violation, alignments)

    def _stillness(self, step: Arm) -> tuple[NDArray[np.float64], bool]:
        """Channel values, shape (n, n_channels), of the first interval in which the storeys are still and True, or of
        the last one and False if they are still moving after `patience`.
        """
        waited = 0.0
        while True:
            blocks = [self._loop.exchange() for _ in range(self._blocks(step.rest))]
            values = np.concatenate([each.values for each in blocks])
            if scatter(np.concatenate([each.signals for each in blocks])) <= step.still:
                return values, True
            waited += step.rest
            if waited >= step.patience:
                self._stream.publish(Warned(f"the storeys are still moving after {waited:g} s; signals tared anyway"))
                return values, False

    def _blocks(self, duration: float) -> int:
        return max(round(duration * self._rig.sample_rate / self._loop.output.block), 1)


class SineDrive:
    """Sweeps and dwells of the oscillator; cycles are counted across dwells until the drive changes."""

    def __init__(self, loop: Loop, rig: Rig) -> None:
        self._loop, self._rate, self._channels = loop, rig.sample_rate, rig.channels
        self._cycles: CycleAnalyser | None = None

    def restart(self) -> None:
        """Start a new count of cycles with the next dwell."""
        self._cycles = None

    def sweep(self, step: Sweep) -> Outcome:
        """Drive the segments of the sweep, starting at the current amplitude and frequency."""
        output = self._loop.output
        output.source.require_silence("segments")
        oscillator = output.source.oscillator
        self.restart()
        for sweep in sweeps(step.segments, oscillator.amplitude, oscillator.omega):
            oscillator.follow(sweep)
        end = output.begins + oscillator.remaining
        while output.read < end:
            _, fell = self._loop.signals()
            if fell:
                return Fallen()
        return Done()

    def dwell(self, step: Dwell) -> Outcome:
        """Hold the sine and measure its cycles."""
        output = self._loop.output
        output.source.require_silence("a dwell")
        if self._cycles is None or step.phase is not None:
            first = output.read if step.phase is None else self._sample_at(step.phase)
            self._cycles = CycleAnalyser(output.source.oscillator.omega, self._rate, first, step.harmonics)
        done: list[Cycle] = []
        missing = Counter[tuple[int, int]]()
        end = self._cycles.completed + step.cycles
        while self._cycles.completed < end:
            first = output.read
            signals, fell = self._loop.signals()
            if fell:
                return Fallen()
            values = np.empty((len(signals), len(SIGNALS) + 1), order="F")
            values[:, :-1], values[:, -1] = signals, output.drive
            if self._loop.latest is not None and np.isnan(signals).any():
                missing += self._invalid(self._loop.latest)
            done += self._cycles.push(values[max(self._cycles.first - first, 0) :])
        most = missing.most_common(1)
        return Measured(tuple(done), (self._channels[most[0][0][0]], most[0][0][1]) if most else None)

    def set_harmonics(self, step: SetHarmonics) -> Scheduled:
        """Change the harmonics of the sine."""
        output, wait = self._loop.output, 0
        if step.cycle is not None and self._cycles is not None:
            wait = self._cycles.start_of(step.cycle) - output.begins
        output.source.oscillator.trim(step.shares, step.blend, max(wait, 0))
        return Scheduled(max(-wait, 0) / self._rate)

    def _invalid(self, counts: Counts) -> Counter[tuple[int, int]]:
        """Number of samples of each invalid count in a block, by column and count, of the channels whose missing
        samples are missing in the cycles.
        """
        return Counter(
            (column, count)
            for column, channel in enumerate(self._channels)
            if channel.name in MEASURED_BY
            for count in counts[:, column].tolist()
            if not channel.valid[0] <= count <= channel.valid[1]
        )

    def _sample_at(self, phase: float) -> int:
        """Index of the first sample not yet read at which the held sine has `phase` [rad]."""
        output = self._loop.output
        oscillator = output.source.oscillator
        # the oscillator's phase is that of the last sample queued in the rig
        queued = output.begins - 1 - output.read
        step = oscillator.omega / self._rate
        return output.read + ceil((phase - oscillator.phase + step * queued) % tau / step)


Array = NDArray[np.float64]


class PreparedDrive:
    """Playback of a prepared drive through the guard, block by block."""

    def __init__(self, loop: Loop, guard: Guard, stream: EventStream) -> None:
        self._loop, self._guard, self._stream = loop, guard, stream

    def play(self, step: Play) -> Outcome:
        """Play the drive to its end, or until the block falls.

        Raises InvalidInput before the first sample if the drive is unsuitable or the guard would refuse it.
        """
        output = self._loop.output
        if output.state is not State.RUNNING:
            raise InvalidInput("state of the bench before a prepared drive", str(output.state), "arm the bench first")
        volts = np.asarray(step.volts, dtype=np.float64)
        output.source.require_playable(volts)
        if (refused := self._guard.refusal(volts)) is not None:
            where = f"{refused.quantity} at sample {refused.sample} of a prepared drive"
            raise InvalidInput(where, f"{refused.value:.4g} {refused.unit}", f"the limit is {refused.limit:g}")
        output.source.play(volts)
        start, end = output.begins, output.begins + volts.size
        signals: list[Array] = [np.zeros((0, len(SIGNALS)))]
        drive: list[Array] = []
        while output.read < end:
            first = output.read
            block, fell = self._loop.signals()
            during = slice(max(start - first, 0), min(end - first, len(block)))
            if during.start < during.stop:
                signals.append(block[during])
                drive.append(output.drive[during])
                self._show(step, signals[-1])
            if fell:
                return Fallen(np.concatenate(signals))
        return Played(np.concatenate(signals), np.concatenate(drive))

    def _show(self, step: Play, signals: Array) -> None:
        if step.watch is None:
            return
        with plugin_code("the live value of the protocol"):
            event = step.watch(signals)
        if event is not None:
            self._stream.publish(event)
