"""Rig whose channels are functions of the drive, and a bench that runs a plan on it, for tests of plans."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import SignalMap
from bench.engine.engine import Engine
from bench.engine.interface import Ending, EventStream, Requests, Unattended
from bench.engine.steps import Outcome, Plan, Step
from bench.events import Event, State, StateChanged
from bench.guard.guard import Guard
from bench.guard.limits import Limits, Ramps
from drivers.border import CheckedRig
from drivers.clock import VirtualClock
from drivers.computed import ComputedRig
from drivers.rig import Channel, Counts, OperatorTask, Rig

COUNTS_PER_UNIT = 1000.0
"""Resolution of every channel [counts per unit of its value]."""


class LoopbackRig(ComputedRig):
    """Rig in virtual time; the value measured by channel `name` is `response[name](volts)`, in the channel's unit.

    NaN becomes -32768 counts, which means no measurement. `played` contains the drive samples of all runs, `done` the
    operator actions carried out, `safety` the states of the safety inputs; `halted` is True once the output has been
    cut.
    """

    def __init__(
        self,
        response: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] | None = None,
        lead: int = 100,
        sample_rate: float = 1000.0,
    ) -> None:
        self.response = response or {
            "table_displacement": lambda volts: 0.01 * volts,
            "table_acceleration": lambda volts: volts,
            "laser_1": lambda volts: 0.001 * volts,
            "laser_2": lambda volts: 0.002 * volts,
        }
        channels = tuple(
            Channel(name, "displacement", "m", 1.0 / COUNTS_PER_UNIT, 0.0, (-32767, 32767), "loopback")
            for name in self.response
        )
        super().__init__(channels, sample_rate, 10.0, lead, VirtualClock(), {"rig": "loopback"})
        self.halted = False
        self.done: list[OperatorTask] = []
        self.played = np.zeros(0)
        self.safety: dict[str, bool] = {}

    def interlocks(self) -> dict[str, bool]:
        return self.safety

    def respond(self, volts: NDArray[np.float64]) -> Counts:
        self.played = np.concatenate((self.played, volts))
        values = np.stack([respond(volts) for respond in self.response.values()], axis=1)
        counts = np.where(np.isnan(values), -32768, np.round(np.nan_to_num(values) * COUNTS_PER_UNIT))
        return counts.astype(np.int16)

    def halt(self) -> None:
        self.halted = True
        super().halt()

    def carry_out(self, work: OperatorTask, amount: float | None) -> None:  # noqa: ARG002
        self.done.append(work)


class LoopbackBench:
    """Guard and engine on a rig, by default a loop-back rig, without a human operator.

    `events` contains every event, `outcomes` the outcomes of the steps that `run_steps` has run. Guard and engine use
    `checked`, the rig with the checks of `drivers.border`, as in a session.
    """

    def __init__(
        self,
        rig: Rig | None = None,
        subscriber: Callable[[Event], None] | None = None,
        limits: Limits | None = None,
        block: int = 100,
    ) -> None:
        self.rig = LoopbackRig() if rig is None else rig
        self.checked = CheckedRig(self.rig, "loopback")
        self.events, self.outcomes = list[Event](), list[Outcome]()
        self.requests, self.operator = Requests(), Unattended()
        guard = Guard(
            self.checked,
            limits or Limits(),
            Ramps(stop=1.0, abort=0.2),
            signals=SignalMap(self.checked.channels, "table"),
        )
        stream = EventStream(self.checked.clock, [self.events.append, *([subscriber] if subscriber else [])])
        self.engine = Engine(self.checked, guard, stream, self.requests, self.operator, block)

    def run(self, plan: Plan) -> Ending:
        """Run a plan to its end. The value returned by the plan is stored in `engine.returned`."""
        return self.engine.run(plan)

    def run_steps(self, *steps: Step) -> Ending:
        """Run a plan of these steps, and append their outcomes to `outcomes`."""

        def plan() -> Plan:
            for step in steps:
                self.outcomes.append((yield step))

        return self.engine.run(plan())

    def states(self) -> list[State]:
        """States entered by the bench, in order."""
        return [event.after for event in self.events if isinstance(event, StateChanged)]
