"""A short experiment on the small bench of the fault tests, made anew in the session's process."""

import time
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.app.ipc.client import SessionClient
from bench.app.ipc.messages import Run
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.control.oscillator import Segment
from bench.datafile.tables import Column, Table
from bench.engine.steps import Arm, Calibrate, Dwell, OperatorAction, Publish, RampOut, Sweep
from bench.events import PointFinished, StepStarted
from bench.live_values import Estimate
from bench.protocol import Plan, Prepared, Protocol, Result, Sources
from drivers.rig import OperatorTask
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from tests.faults.setup import AMPLITUDE, BARE, CALIBRATION, LIMITS, OMEGA, PARAMETERS, RAMPS, NoPoint

CYCLES = 4 * 60
"""Cycles of the longest run: a minute."""


class ShakingParameters(Parameters):
    """One sine on the bare frame."""

    cycles: int = quantity(CYCLES, "1", "cycles of the sine", ge=1, le=10_000)
    gossip: int = quantity(0, "1", "events that are told between two cycles", ge=0)
    drawing: float = quantity(0.0, "s", "time that the figure takes", ge=0)
    amplitude: float = quantity(AMPLITUDE, "m/s2", "amplitude of the table acceleration", gt=0, le=2)


class Shaking(Prepared[ShakingParameters]):
    """Arms, shakes and ramps out."""

    def __init__(
        self, parameters: ShakingParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        if configuration.limits.acceleration < parameters.amplitude:
            raise InvalidInput("amplitude", parameters.amplitude, "the limit is lower")

    @cached_property
    def prediction(self) -> Table:
        return {"value": Column(np.array([1.0]), "1", f"of the {self.configuration.backend} bench")}

    def plan(self) -> Plan:
        yield OperatorAction(OperatorTask.REMOVE_BLOCK, self.configuration.specimen, "Take the block off the table.")
        yield Publish(StepStarted("shaking", time=0.0))
        yield Arm(0.2, patience=5.0)
        yield Calibrate(CALIBRATION)
        yield Sweep((Segment(0.25, self.parameters.amplitude, OMEGA),))
        for cycle in range(self.parameters.cycles):
            yield Dwell(1)
            for _ in range(self.parameters.gossip):
                yield Publish(Estimate(OMEGA, None, cycle, 0.001, float("nan"), float("nan"), float("nan"), time=0.0))
        yield RampOut()
        point = NoPoint(value=1.0)
        yield Publish(PointFinished(point, time=0.0))
        return self.result([point])

    def result(self, points: Sequence[Parameters]) -> Result:
        def draw(path: Path) -> None:
            for _ in range(round(self.parameters.drawing / 0.01)):
                time.sleep(0.01)
            path.write_text(f"{len(points)} of {len(self.prediction)}", encoding="utf-8")

        return Result(tuple(points), f"{len(points)} points", {"none.png": draw})


SHAKING = Protocol(
    name="shaking",
    summary="One sine.",
    details="For tests.",
    parameters=ShakingParameters,
    point=NoPoint,
    prepare=Shaking,
    figures=("none.png",),
)


def bench() -> BenchConfiguration:
    """The small bench: it rests soon and ramps fast."""
    return BenchConfiguration(
        specimen=BARE,
        # these tests are about the link: a busy machine may be late
        limits=LIMITS.model_copy(update={"late": 5.0}),
        ramps=RAMPS,
        acquisition=Acquisition(block_duration=0.05, lead=1.0),
        simulation=Simulation(bench=PARAMETERS),
    )


def order(out: Path, *, realtime: bool = True, person: bool = False, keep_going: bool = False, **asked: object) -> Run:
    """The order for a run with these parameters."""
    parameters = ShakingParameters.model_validate(asked)
    return Run(
        SHAKING.name,
        parameters,
        bench(),
        out,
        realtime=realtime,
        person=person,
        keep_going=keep_going,
        about={"notes": "n"},
    )


def begun(out: Path, **asked: object) -> SessionClient:
    """A link with such a run under way."""
    return SessionClient(order(out, **asked))  # type: ignore[arg-type]
