"""Plays a prepared drive, and gives back what happened sample by sample."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import SIGNALS
from bench.engine.steps import Fallen, Outcome, Play, Played
from bench.engine.stream import Stream
from bench.engine.turns import Turns
from bench.events import State
from bench.guard.guard import Guard
from sim.errors import InvalidInput

Array = NDArray[np.float64]


class Player:
    """The prepared drive goes the way of every other: through the guard, block by block."""

    def __init__(self, turns: Turns, guard: Guard, stream: Stream) -> None:
        self._turns, self._guard, self._stream = turns, guard, stream

    def play(self, step: Play) -> Outcome:
        """Play all of it, or until the block has fallen. Raises InvalidInput, nothing of it played, where it cannot be.

        A drive that the guard would refuse somewhere is refused before it begins.
        """
        output = self._turns.output
        if output.state is not State.RUNNING:
            raise InvalidInput("prepared drive on a bench that is", str(output.state), "arm it first")
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
            block, fell = self._turns.signals()
            during = slice(max(start - first, 0), min(end - first, len(block)))
            if during.start < during.stop:
                signals.append(block[during])
                drive.append(output.drive[during])
                self._show(step, signals[-1])
            if fell:
                return Fallen(np.concatenate(signals))
        return Played(np.concatenate(signals), np.concatenate(drive))

    def _show(self, step: Play, signals: Array) -> None:
        event = step.watch(signals) if step.watch is not None else None
        if event is not None:
            self._stream.publish(event)
