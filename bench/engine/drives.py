"""Steps that drive the table, by the oscillator or by a prepared drive."""

from collections import Counter
from math import ceil, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.analysis.signals import MEASURED_BY, SIGNALS
from bench.control.oscillator import sweeps
from bench.engine.interface import EventStream
from bench.engine.loop import Loop
from bench.engine.steps import (
    Done,
    Dwell,
    Fallen,
    Measured,
    Outcome,
    Play,
    Played,
    Scheduled,
    SetHarmonics,
    Sweep,
)
from bench.events import State
from bench.guard.guard import Guard
from bench.plugins import plugin_code
from drivers.rig import Counts, Rig
from sim.errors import InvalidInput

Array = NDArray[np.float64]


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
