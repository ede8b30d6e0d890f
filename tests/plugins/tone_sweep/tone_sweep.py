"""Tone sweep: the acceleration of the table per volt of drive at a few frequencies, with the bare frame on it."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from pydantic import PositiveFloat

from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.oscillator import DriveCalibration, Segment, program
from bench.datafile.tables import Column, Table
from bench.document.campaign import Campaign
from bench.document.document import Picture, Section
from bench.engine.steps import Arm, Calibrate, Dwell, Measured, OperatorAction, Publish, RampOut, Sweep
from bench.events import PointFinished, StepStarted
from bench.figures.style import new_figure, write_figure
from bench.live_values import LiveValue
from bench.live_view import LiveRun, Panel
from bench.preflight.demands import load, response_of
from bench.preflight.margins import Demand, Forecast, Stage, bounds
from bench.protocol import Plan, Prepared, Protocol, Result, RunView
from drivers.rig import OperatorTask
from sim.parameters import Parameters, quantity


class SweepParameters(Parameters):
    """Sines of one drive amplitude, one frequency after the other."""

    omega: tuple[PositiveFloat, ...] = quantity((10.0, 20.0, 40.0), "rad/s", "circular frequencies", min_length=1)
    volts: float = quantity(0.05, "V", "amplitude of the drive", gt=0, le=1)
    cycles: int = quantity(8, "1", "cycles that are measured at each frequency", ge=4, le=100)


class SweepPoint(Parameters):
    """The gain at one frequency."""

    omega_rad_s: float = quantity(..., "rad/s", "circular frequency")
    gain_m_s2_v: float = quantity(..., "m/s2/V", "acceleration of the table over the drive")
    gain_uncertainty: float = quantity(..., "m/s2/V", "expanded uncertainty of the gain (k = 2), by its scatter")


class ToneSweep(Prepared[SweepParameters]):
    @cached_property
    def gains(self) -> np.ndarray:
        """Predicted gains [m/s2/V]; NaN where nothing is known of the table."""
        table, omega = response_of(self.configuration), np.array(self.parameters.omega)
        return omega * np.nan if table is None else table.gain(omega, self.configuration.known_specimen.bare().mass)

    @cached_property
    def forecast(self) -> Forecast:
        p, mass = self.parameters, self.configuration.known_specimen.bare().mass
        length = sum((p.cycles + 2) * 2.0 * np.pi / omega + 2.0 for omega in p.omega)
        if (table := response_of(self.configuration)) is None:
            return Forecast(duration=length)
        pairs = zip(self.gains.tolist(), p.omega, strict=True)
        segments = tuple(Segment(1.0, level * p.volts, omega) for gain, omega in pairs for level in (gain, 0.0))
        shaker, time = self.configuration.shaker_model, self.configuration.limits.heating_time
        demands = load(program(segments), 0.0, length, payload=mass, shaker=shaker, response=table, heating_time=time)
        found = [Demand(key, demands[key], None, "the sweep") for key in bounds(self.configuration) if key in demands]
        return Forecast(tuple(found), (Stage("the sweep", segments),), length)

    @cached_property
    def prediction(self) -> Table:
        omega = Column(np.array(self.parameters.omega), "rad/s", "circular frequency")
        return {"omega": omega, "gain": Column(self.gains, "m/s2/V", "predicted gain")}

    def plan(self) -> Plan:
        p, bare, points = self.parameters, self.configuration.known_specimen.bare(), list[SweepPoint]()
        yield OperatorAction(OperatorTask.REMOVE_BLOCK, bare, "Take the spring and the block off the table.")
        yield Arm(2.0)
        yield Calibrate(DriveCalibration.flat(1.0))  # amplitudes are volts
        for omega, predicted in zip(p.omega, self.gains, strict=True):
            yield Publish(StepStarted(f"sweep at {omega:g} rad/s"))
            yield Sweep((Segment(1.0, p.volts, omega),))
            outcome = yield Dwell(p.cycles + 2)
            cycles = outcome.cycles[2:] if isinstance(outcome, Measured) else ()
            if len(cycles) >= 4:
                gains = [abs(each.fundamental[ACCELERATION] / each.fundamental[len(SIGNALS)]) for each in cycles]
                gain, doubt = float(np.mean(gains)), 2.0 * float(np.std(gains, ddof=1)) / len(gains) ** 0.5
                yield Publish(LiveValue("gain of the table", gain, "m/s2/V", doubt, float(predicted)))
                points.append(SweepPoint(omega_rad_s=omega, gain_m_s2_v=gain, gain_uncertainty=doubt))
                yield Publish(PointFinished(points[-1]))
            yield Sweep((Segment(1.0, 0.0, omega),))
        yield RampOut()
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        rows = [point.model_dump() for point in points]
        text = "\n".join(", ".join(f"{name} {value:.4g}" for name, value in row.items()) for row in rows)
        return Result(tuple(points), text, figures={"gain.png": lambda path: write_figure(path, drawn(rows))})


def drawn(rows):
    figure = new_figure(6.0, 4.0)
    panel = figure.add_subplot(xlabel="omega [rad/s]", ylabel="gain [m/s2/V]")
    panel.errorbar(*([row[name] for row in rows] for name in SweepPoint.model_fields), fmt="o")
    return figure


def report(campaign: Campaign) -> list[Section]:
    return [Section("sweep", "Tone sweep", [Picture(drawn(campaign.points), "Gain, k = 2.", "Gain over frequency.")])]


def live(run: LiveRun) -> list[Panel]:
    panel = Panel("", ("omega", "rad/s"), ("gain", "m/s2/V"))
    panel.predicted("predicted", run.predicted("omega"), run.predicted("gain"))
    return [panel.points("measured", *map(run.column, SweepPoint.model_fields))]


PROTOCOL = Protocol(
    name="tone-sweep",
    summary="Gain of the table at a few frequencies.",
    details="Drives sines of one amplitude with the bare frame on the table.",
    parameters=SweepParameters,
    point=SweepPoint,
    prepare=ToneSweep,
    figures=("gain.png",),
    report=report,
    view=RunView(live=live),
)
