"""Follows sweeps with the oscillator, and measures the cycles of the sine that it holds."""

import numpy as np

from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.control.legs import sweeps
from bench.engine.steps import Done, Dwell, Fallen, Follow, Measured, Outcome, Trim
from bench.engine.turns import Turns


class Sines:
    """Cycles are counted on from dwell to dwell, until the drive goes elsewhere."""

    def __init__(self, turns: Turns, sample_rate: float) -> None:
        self._turns, self._rate = turns, sample_rate
        self._cycles: CycleAnalyser | None = None

    def forget(self) -> None:
        """The next dwell begins to count anew."""
        self._cycles = None

    def follow(self, step: Follow) -> Outcome:
        """Drive along the legs, from where the drive is."""
        output = self._turns.output
        output.source.require_silence("legs")
        oscillator = output.source.oscillator
        self.forget()
        for sweep in sweeps(step.legs, oscillator.amplitude, oscillator.omega):
            oscillator.follow(sweep)
        end = output.begins + oscillator.remaining
        while output.read < end:
            _, fell = self._turns.signals()
            if fell:
                return Fallen()
        return Done()

    def dwell(self, step: Dwell) -> Outcome:
        """Hold the sine for some cycles."""
        output = self._turns.output
        output.source.require_silence("a dwell")
        if self._cycles is None:
            self._cycles = CycleAnalyser(output.source.oscillator.omega, self._rate, output.read)
        done: list[Cycle] = []
        end = self._cycles.completed + step.cycles
        while self._cycles.completed < end:
            signals, fell = self._turns.signals()
            if fell:
                return Fallen()
            done += self._cycles.push(np.column_stack((signals, output.drive)))
        return Measured(tuple(done))

    def trim(self, step: Trim) -> None:
        """Change the harmonics of the sine."""
        self._turns.output.source.oscillator.trim(step.shares)
