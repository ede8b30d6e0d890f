"""What is done with the output at zero: taking the zero of every signal, and listening."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.signals import scatter
from bench.engine.steps import Arm, Heard, Listen
from bench.engine.stream import Stream
from bench.engine.turns import Turns
from bench.events import State, Warned
from bench.guard.guard import Guard
from bench.guard.violation import Violation
from drivers.rig import Counts, Rig
from sim.specimen import Specimen


class Rest:
    """Waits for stillness, or hears what comes in."""

    def __init__(self, turns: Turns, rig: Rig, guard: Guard, stream: Stream) -> None:
        self._turns, self._rig, self._guard, self._stream = turns, rig, guard, stream
        self.sees_storeys = True
        """Whether the laser of storey 2 looks at its storey: the difference of the lasers is no drift otherwise."""

    def arm(self, step: Arm, specimen: Specimen | None) -> None:
        """Arm, wait until the storeys are still, and take the zero of every signal."""
        self._turns.begin("the operator's work is done")
        rest = self._stillness(step)
        self._guard.tare(rest, drift=self.sees_storeys)
        self._turns.fall = FallWatch(specimen, self._rig.sample_rate) if specimen else None
        self._turns.output.machine.go(State.RUNNING, "at rest, zero taken")

    def listen(self, step: Listen) -> Heard:
        """A violation ends the listening but not the plan, which may want to know what is wrong: nothing is driven."""
        output = self._turns.output
        self._turns.begin("to listen with the output at zero")
        counts: list[Counts] = []
        violation: Violation | None = None
        for _ in range(self._blocks(step.duration)):
            exchange = output.exchange()
            counts.append(exchange.block.counts)
            violation = exchange.violation
            if violation is not None:
                self._guard.halt()
                break
            self._turns.heed_requests()
        output.machine.go(State.STOPPING, "enough was heard" if violation is None else str(violation))
        output.rest()
        return Heard(self._rig.channels, np.concatenate(counts), violation)

    def _stillness(self, step: Arm) -> NDArray[np.float64]:
        """Channel values over a rest during which the storeys were still, shape (n, n_channels)."""
        waited = 0.0
        while True:
            blocks = [self._turns.exchange() for _ in range(self._blocks(step.rest))]
            values = np.concatenate([each.values for each in blocks])
            if scatter(np.concatenate([each.signals for each in blocks])) <= step.still:
                return values
            waited += step.rest
            if waited >= step.patience:
                self._stream.publish(Warned(f"the storeys are not still after {waited:g} s; zero taken anyway"))
                return values

    def _blocks(self, duration: float) -> int:
        return max(round(duration * self._rig.sample_rate / self._turns.output.block), 1)
