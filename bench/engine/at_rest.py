"""Steps with the output at zero."""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.signals import scatter
from bench.engine.interface import EventStream
from bench.engine.loop import Loop
from bench.engine.steps import AcquireAtRest, Arm, RestSamples
from bench.events import State, Warned
from bench.guard.guard import Guard
from bench.guard.limits import Violation
from drivers.rig import Alignment, Counts, Rig
from sim.errors import RockbenchError
from sim.specimen import Specimen


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
