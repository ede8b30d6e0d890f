"""Stability test: checks, starts, forecast, predicted curve and result."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from math import tau
from typing import Any

import numpy as np

from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment
from bench.control.starts import Start, plan_starts
from bench.datafile.tables import Column, Table, arrays
from bench.figures.style import write_figure
from bench.preflight.demands import TableResponse, response_of
from bench.preflight.margins import Forecast, Stage
from bench.progress import counting
from bench.protocol import Plan, Prepared, Result, Sources
from bench.result_cache import cached
from protocols.common.sine.demands import (
    HOLD,
    Trial,
    bare_calibration_trial,
    demands_of,
    spring_calibration_trial,
)
from protocols.common.sine.holding import PATIENCE, too_late
from protocols.common.sine.pace import Pace
from protocols.stability.laws import (
    HOUSNER,
    WORDS,
    LawPrediction,
    closest,
    deviation,
    law_boundaries,
    law_prediction,
    predicted_columns,
)
from protocols.stability.plan import SWEEP_TIME, Place, StabilityPlan
from protocols.stability.prediction import on_table, rocking
from protocols.stability.protocol import StabilityParameters, StabilityPoint
from protocols.stability.release import DEFLECTION
from protocols.stability.results import stability_figure, stability_table
from sim.errors import InvalidInput
from sim.loading import load_model
from sim.parameters import Parameters
from sim.restitution_laws import laws as laws_of
from sim.sweep import in_threads

CURVE = 25
"""Number of points of the predicted curve."""


class StabilityTest(Prepared[StabilityParameters]):
    """Stability test. Raises InvalidInput for a bench whose corrections would come too late to hold a motion, or a
    point without a rocking orbit.
    """

    def __init__(
        self, parameters: StabilityParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._specimen = configuration.known_specimen.coupled(parameters.beta)
        self._places = [Place(omega, factor) for omega in parameters.omega for factor in parameters.amplitude_factor]
        for omega in parameters.omega:
            if (reason := too_late(configuration, omega)) is not None:
                raise InvalidInput("omega", omega, reason)

    @cached_property
    def starts(self) -> Mapping[Place, Sequence[Start]]:
        """Starts to try at each planned point, the most promising first, computed before the bench is armed."""
        load_model(self.progress)
        done = counting(self.progress, "planning the starts")
        found: dict[Place, Sequence[Start]] = {}
        for place in self._places:
            amplitude = place.factor * self._specimen.uplift_acceleration
            orbit = rocking(self._specimen, place.omega, amplitude)
            if orbit is None:
                over = len(self.parameters.amplitude_factor) > 1
                raise InvalidInput(
                    *(("amplitude_factor", place.factor) if over else ("omega", place.omega)),
                    "the model has no rocking orbit at this frequency and amplitude",
                )
            found[place] = plan_starts(
                self._specimen, place.omega, amplitude, orbit, self.parameters.starts, self.configuration.known
            )
            done(len(found), len(self._places))
        return found

    @cached_property
    def forecast(self) -> Forecast:
        found = list(self._trials(response_of(self.configuration)))
        return Forecast(
            demands=demands_of(found, self.configuration, progress=self.progress),
            stages=tuple(trial.stage for trial in found),
            duration=Pace(tuple(place.omega for place in self._places), 1).progress("").remaining,
        )

    def _trials(self, response: TableResponse | None) -> Iterator[Trial]:
        """Every stage that the plan may reach; the bisection adds a sweep from the first start of each point to its
        neighbours.
        """
        p, known = self.parameters, self.configuration.known_specimen
        lowest = min(p.amplitude_factor) * known.uplift_acceleration
        yield bare_calibration_trial(p, p.omega, lowest, known, response)
        starts = [start for each in self.starts.values() for start in each]
        yield spring_calibration_trial(self._specimen, p.omega, starts, p.calibration_level * lowest)
        for place, planned in self.starts.items():
            cycles = 2.0 * PATIENCE + DEFLECTION + p.released_cycles + p.measured_cycles
            longest = p.settle_limit + cycles * tau / place.omega
            for number, start in enumerate(planned, 1):
                name = f"start {number} at {place.omega:g} rad/s and {place.factor:g} times the uplift acceleration"
                stage = Stage(name, start.segments, start.chance)
                yield Trial(stage, self._specimen, (), HOLD, longest, p.beta, None, p.hold_authority)
            for other in self._neighbours(place) if p.bisect else ():
                start = planned[0]
                amplitude = other.factor * known.uplift_acceleration
                segments = (*start.segments, Segment(SWEEP_TIME, amplitude, other.omega))
                name = f"sweep from {place.omega:g} to {other.omega:g} rad/s"
                if other.factor != place.factor:
                    name = f"amplitude change from {place.factor:g} to {other.factor:g} times the uplift acceleration"
                yield Trial(Stage(name, segments), self._specimen, (), HOLD, longest, p.beta, None, p.hold_authority)

    def _neighbours(self, place: Place) -> list[Place]:
        ordered = sorted(self._places, key=lambda each: (each.omega, each.factor))
        at = ordered.index(place)
        return [*ordered[max(at - 1, 0) : at], *ordered[at + 1 : at + 2]]

    @cached_property
    def prediction(self) -> Table:
        """Predicted multiplier against frequency or amplitude, on fixed ground and on the table."""
        p, shaker = self.parameters, self.configuration.simulated_shaker
        uplift = self._specimen.uplift_acceleration
        places = self._curve()

        known = self.configuration.known_on_table

        def one(place: Place) -> dict[str, Any]:
            orbit = rocking(self._specimen, place.omega, place.factor * uplift)
            none = complex(np.nan, np.nan)
            if orbit is None:
                laws = LawPrediction({law.name: np.nan for law in laws_of(p.impulse_offset)}, np.nan, np.nan)
                return {"fixed": [np.nan] * 2, "table": [np.nan] * 2, **predicted_columns(laws)}
            moving = on_table(orbit, shaker, p.harmonics)
            multiplier = orbit.slowest if moving is None else moving
            laws = law_prediction(orbit, multiplier, known, shaker, p.harmonics, p.impulse_offset)
            pairs = {"fixed": orbit.slowest, "table": none if moving is None else moving}
            return {**{name: [z.real, z.imag] for name, z in pairs.items()}, **predicted_columns(laws)}

        def computed() -> dict[str, Any]:
            found = in_threads(one, places, counting(self.progress, "predicting the multipliers"))
            return {name: [each[name] for each in found] for name in found[0]}

        model = None if shaker is None else shaker.model_dump(mode="json")
        inputs = [self._specimen.model_dump(mode="json"), [[each.omega, each.factor] for each in places], model]
        uncertain = [known.model_dump(mode="json"), p.impulse_offset]
        stored = cached("stability_curve", [*inputs, p.harmonics, *uncertain], computed)
        fixed, table = (np.array(stored[name]) @ np.array([1.0, 1j]) for name in ("fixed", "table"))
        others = {law.name: law.words for law in laws_of(p.impulse_offset)}
        return {
            "omega_rad_s": Column(np.array([each.omega for each in places]), "rad/s", "circular frequency"),
            "amplitude_factor": Column(
                np.array([each.factor for each in places]), "1", "amplitude relative to the uplift acceleration"
            ),
            "fixed_modulus": Column(np.abs(fixed), "1", "modulus of the dominant multiplier on fixed ground"),
            "fixed_angle_rad": Column(
                np.abs(np.angle(fixed)), "rad", "argument of the dominant multiplier, fixed ground"
            ),
            "table_modulus": Column(np.abs(table), "1", "modulus of the dominant multiplier on the simulated table"),
            "table_angle_rad": Column(
                np.abs(np.angle(table)), "rad", "argument of the dominant multiplier, simulated table"
            ),
            **{
                f"{name}_modulus": Column(
                    np.array(stored[f"{name}_modulus"]), "1", f"modulus of the dominant multiplier with {words}"
                )
                for name, words in others.items()
            },
            "law_modulus_uncertainty": Column(
                np.array(stored["law_modulus_uncertainty"]),
                "1",
                "expanded uncertainty (k = 2) of a modulus with an exact law of restitution, due to the specimen",
            ),
        }

    def _curve(self) -> list[Place]:
        p = self.parameters
        omegas = np.linspace(min(p.omega), max(p.omega), CURVE if len(p.omega) > 1 else 1)
        factors = np.linspace(
            min(p.amplitude_factor), max(p.amplitude_factor), CURVE if len(p.amplitude_factor) > 1 else 1
        )
        return [Place(float(omega), float(factor)) for omega in omegas for factor in factors]

    def plan(self) -> Plan:
        points = yield from StabilityPlan(self.parameters, self.configuration, self.starts).steps()
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        rows = [point for point in points if isinstance(point, StabilityPoint)]
        curve = arrays(self.prediction)
        return Result(
            points=tuple(points),
            text=stability_table(rows, curve),
            findings={"restitution_laws": self._laws(rows, curve)},
            figures={"stability.png": lambda path: write_figure(path, stability_figure(rows, curve))},
        )

    def _laws(self, rows: Sequence[StabilityPoint], curve: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Restitution, predicted boundaries and normalised deviations of the measured moduli of each law."""
        block = self._specimen.block
        restitution = {HOUSNER: block.restitution}
        restitution |= {law.name: law.restitution(block) for law in laws_of(self.parameters.impulse_offset)}
        places = law_boundaries(curve)
        return [
            {
                "law": law,
                "restitution": restitution[law],
                "boundaries": [{"place": each.place, "uncertainty": each.uncertainty} for each in places[law]],
                "deviations": [deviation(point, law) for point in rows],
                "closest_at": sum(closest(point) == law for point in rows),
            }
            for law in WORDS
        ]
