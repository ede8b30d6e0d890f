"""Boundaries from points and curves, predicted multipliers, and the deflection before a release."""

from collections.abc import Generator, Mapping
from dataclasses import replace
from math import hypot
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pydantic import ValidationError

from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition
from bench.control.oscillator import Segment
from bench.control.starts import Start
from bench.datafile.tables import Column
from bench.document.campaign import Campaign
from bench.document.document import Listing, Table
from bench.engine.steps import Done, Dwell, Measured, Outcome, Publish, Step
from bench.events import Progress
from protocols.common.sine.holding import prepared
from protocols.stability.experiment import StabilityTest
from protocols.stability.plan import Place, StabilityPlan
from protocols.stability.prediction import boundaries, close_pair, predicted, rocking
from protocols.stability.protocol import OrbitStatus, StabilityParameters, StabilityPoint
from protocols.stability.release import DEFLECTION, deflection
from protocols.stability.results import (
    boundary_texts,
    measured_boundaries,
    stability_figure,
    stability_sections,
    stability_table,
)
from sim.cycle_map import cycle_map
from sim.errors import InvalidInput
from sim.knowledge import SpecimenKnowledge, SpecimenUncertainty
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit
from tests.protocols.harmonic.scripted import cycle

AMPLITUDE = 1.01 * Specimen().uplift_acceleration


def orbit(omega: float = 15.0, beta: float = 0.97) -> Orbit:
    found = rocking(Specimen().coupled(beta), omega, AMPLITUDE)
    assert found is not None
    return found


def point(omega: float, modulus: float | None, uncertainty: float = 0.002) -> StabilityPoint:
    status = OrbitStatus.NOT_HELD if modulus is None else OrbitStatus.MEASURED
    return StabilityPoint(
        omega_rad_s=omega,
        amplitude_factor=1.01,
        beta=0.97,
        status=status,
        modulus=modulus,
        modulus_uncertainty=None if modulus is None else uncertainty,
    )


def test_a_boundary_on_a_straight_line_has_the_uncertainty_of_the_moduli_over_the_slope() -> None:
    (found,) = boundaries([15.6, 15.0, 15.2], [0.98, 1.04, 1.02], [0.001] * 3)
    assert found.place == pytest.approx(15.4)
    assert found.uncertainty == pytest.approx(2.0 * 0.001 / 0.1)
    assert (found.low, found.high) == (15.2, 15.6)


def test_a_bent_curve_adds_its_deviation_from_the_chord() -> None:
    (found,) = boundaries([0.0, 1.0, 2.0], [0.97, 1.01, 1.07], [0.0] * 3)
    # the parabola through the three points, 0.97 + 0.03 x + 0.01 x^2
    exact = (-0.03 + np.sqrt(0.03**2 + 4.0 * 0.01 * 0.03)) / 0.02
    assert found.place == pytest.approx(0.75)
    assert abs(found.place - exact) <= found.uncertainty


def test_points_without_a_multiplier_are_omitted() -> None:
    points = [point(15.0, 1.05), point(15.2, None), point(15.4, 0.99)]
    (found,) = measured_boundaries(points)
    assert (found.low, found.high) == (15.0, 15.4)
    assert boundaries([1.0], [0.9], [0.0]) == []


def test_without_a_boundary_the_text_states_what_was_found() -> None:
    curve = {
        "omega_rad_s": np.array([15.0, 15.2]),
        "amplitude_factor": np.array([1.01, 1.01]),
        "fixed_modulus": np.array([1.05, 1.03]),
        "table_modulus": np.array([np.nan, np.nan]),
    }
    texts = boundary_texts([point(15.0, 1.05), point(15.2, 1.03)], curve)
    assert texts[0] == "no boundary was crossed: every measured orbit is unstable"
    assert texts[1:] == ["predicted boundary on fixed ground: none in this range"]
    near, far = point(12.5, 1.0004, 0.002), point(15.0, 1.05)
    (first, _) = boundary_texts([near], curve)
    assert first == "no boundary was crossed: every measured modulus is not distinguishable from 1 (k = 2)"
    (first, _) = boundary_texts([near, far, point(15.2, 1.03)], curve)
    assert first == (
        "no boundary was crossed: 2 measured orbits are unstable, 1 modulus is not distinguishable from 1 (k = 2)"
    )
    figure = stability_figure([near, far], curve | {"fixed_angle_rad": np.ones(2), "table_angle_rad": np.ones(2)})
    labels = {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    assert labels == {
        "predicted, fixed ground",
        "measured, unstable",
        "measured, not distinguishable from 1",
    }


def test_points_of_a_bisection_have_their_digits_in_table_and_remarks() -> None:
    curve = {"omega_rad_s": np.array([15.25, 15.375]), "amplitude_factor": np.array([1.01, 1.01])}
    curve |= {f"{ground}_modulus": np.array([1.01, 0.99]) for ground in ("fixed", "table")}
    middle = point(15.3125, None).model_copy(update={"reason": "not captured"})
    lines = stability_table([middle], curve).splitlines()
    assert any(line.split()[:2] == ["15.3125", "1.0100"] for line in lines)
    assert lines[-1] == "15.3125 rad/s, amplitude factor 1.0100: not captured"
    columns = curve | {"fixed_angle_rad": np.ones(2), "table_angle_rad": np.ones(2)}
    tables = {"prediction": {name: Column(values, "", "") for name, values in columns.items()}}
    measured = point(15.28125, 1.01).model_copy(update={"uncertainty_parts": '{"noise": 0.001}'})
    campaign = SimpleNamespace(
        points=[middle.model_dump(), measured.model_dump()], record=SimpleNamespace(tables=tables)
    )
    (section,) = stability_sections(cast("Campaign", campaign))
    rows = [row for part in section.parts if isinstance(part, Table) for row in part.rows]
    assert ["15.2812", "1.0100"] in [row[:2] for row in rows]
    assert "15.2812 rad/s, amplitude factor 1.0100" in [row[0] for row in rows]
    assert section.parts[-1] == Listing([lines[-1]])


def test_the_sensitivity_to_the_amplitude_and_the_uncertainty_of_a_prediction() -> None:
    """Against orbits computed anew; without uncertainty of the specimen, that of the modulus is zero."""
    exact = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
    found = predicted(orbit(), exact, None, 1)
    assert found.uncertainty == 0.0
    assert found.table is None
    assert found.multiplier == orbit().slowest
    more, less = (rocking(Specimen().coupled(0.97), 15.0, by * AMPLITUDE) for by in (1.005, 0.995))
    assert more is not None
    assert less is not None
    assert found.slope == pytest.approx((more.multiplier - less.multiplier) / 0.01, rel=0.02)
    assert found.slope_spread == found.turn_spread == 0.0
    damping = exact.model_copy(update={"damping": 0.3})
    uncertain = predicted(orbit(), damping, None, 1)
    assert 0.0 < uncertain.uncertainty < 0.1
    slopes = [
        [predicted(rocking_orbit(each, 15.0, AMPLITUDE, guess=orbit()), exact, None, 1) for each in pair]
        for pair in damping.deviations(orbit().specimen, 0.1)
    ]
    for name in ("slope", "turn"):
        parts = [5.0 * (getattr(more, name) - getattr(less, name)) for more, less in slopes]
        assert getattr(uncertain, f"{name}_spread") == pytest.approx(hypot(*parts), rel=1e-4)


def test_a_measured_modulus_determines_the_slope_as_far_as_they_are_tied() -> None:
    """If only the spring is uncertain, a modulus determines the specimen, and thus its slopes. A modulus that is
    known no better than the specimen leaves half of the correction, and one that is unknown leaves all.
    """
    nominal = Specimen().coupled(0.97)
    near = rocking(nominal, 15.4, AMPLITUDE)
    assert near is not None
    exact = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
    spring = exact.model_copy(update={"spring": 0.04})
    ((stiffer, _),) = spring.deviations(nominal, 0.2)
    other = rocking_orbit(stiffer, 15.4, AMPLITUDE, guess=near)
    expected = predicted(other, exact, None, 1)
    on_ground = predicted(near, spring, None, 1)
    assert on_ground.given(other.multiplier, 1e-6) is on_ground
    # a table that does not recoil
    found = replace(on_ground, table=near.slowest)
    assert abs(expected.slope - found.slope) > 0.01
    known = found.given(other.multiplier, 1e-6)
    assert known.slope == pytest.approx(expected.slope, abs=0.1 * abs(expected.slope - found.slope))
    assert known.turn == pytest.approx(expected.turn, abs=0.1 * abs(expected.turn - found.turn))
    assert known.slope_spread < 0.01 * found.slope_spread
    half = found.given(other.multiplier, found.variance**0.5)
    assert half.slope - found.slope == pytest.approx(0.5 * (known.slope - found.slope), rel=1e-3)
    assert half.slope_spread == pytest.approx(0.5**0.5 * found.slope_spread, rel=1e-6)
    assert found.given(other.multiplier, 1e6).slope == pytest.approx(found.slope, rel=1e-6)
    assert expected.given(1.0, 0.0) is expected


def test_the_spread_of_the_sensitivity_is_that_of_one_pair() -> None:
    """At 15.6 rad/s, two pairs of multipliers have nearly the same modulus, and exchange dominance within the
    uncertainty of the specimen: the spread is a hundred times that of a hundredth of this uncertainty.
    """
    near = rocking(Specimen().coupled(0.97), 15.6, AMPLITUDE)
    assert near is not None
    known = SpecimenKnowledge()
    little = known.model_copy(update={name: 0.01 * getattr(known, name) for name in SpecimenUncertainty.model_fields})
    wide, narrow = (predicted(near, each, None, 1) for each in (known, little))
    assert wide.slope_spread == pytest.approx(100.0 * narrow.slope_spread, rel=0.02)
    assert wide.turn_spread == pytest.approx(100.0 * narrow.turn_spread, rel=0.02)


@pytest.mark.parametrize(("omega", "beta"), [(15.0, 0.97), (16.0, 0.4)])
def test_the_deflection_excites_the_slowest_pair_only(omega: float, beta: float) -> None:
    found = cycle_map(orbit(omega, beta), BenchConfiguration().simulated_shaker, 5)
    controls = deflection(found, 60, 0.1)
    assert controls.shape == (DEFLECTION,)
    assert np.abs(controls).max() <= 0.1
    x, (b1, b0), last = np.zeros(found.transition.shape[0]), found.inputs, np.zeros(2)
    for control in (*controls, 0j):
        now = np.array([control.real, control.imag])
        x = found.transition @ x + b1 @ last + b0 @ now
        last = now
    multipliers, vectors = np.linalg.eig(found.transition)
    shares = np.abs(np.linalg.inv(vectors) @ x) * np.linalg.norm(vectors, axis=0)
    slow = np.isclose(np.abs(multipliers), abs(found.slowest))
    assert slow.sum() == 2
    assert shares[~slow].max() < 1e-6 * shares[slow].max()
    deviation = np.linalg.norm(found.outputs @ x) / np.linalg.norm(found.orbit)
    assert 0.005 < deviation < 0.15


def test_several_frequencies_and_amplitudes_are_refused() -> None:
    with pytest.raises(ValidationError, match="only at a single frequency"):
        StabilityParameters(omega=(15.0, 15.2), amplitude_factor=(1.0, 1.1))


def test_a_bench_whose_corrections_come_too_late_is_refused() -> None:
    slow = BenchConfiguration(acquisition=Acquisition(block_duration=0.1, lead=0.4))
    with pytest.raises(InvalidInput, match="are longer than a cycle"):
        StabilityTest(StabilityParameters(), slow)


@pytest.mark.parametrize(
    ("points", "field", "value"),
    [({"amplitude_factor": (0.1, 0.2)}, "amplitude_factor", 0.1), ({"amplitude_factor": (0.1,)}, "omega", 4.0)],
)
def test_a_planned_point_without_rocking_orbit_is_refused_by_the_varied_parameter(
    points: dict[str, Any], field: str, value: float
) -> None:
    parameters = StabilityParameters.model_validate({"omega": (4.0,), **points})
    with pytest.raises(InvalidInput, match="no rocking orbit") as refused:
        _ = StabilityTest(parameters, BenchConfiguration()).starts
    assert (refused.value.item, refused.value.value) == (field, value)


def test_the_bisection_takes_the_middle_of_the_widest_bracket() -> None:
    parameters = StabilityParameters(omega=(15.0, 15.2, 15.6, 16.0), bracket=0.01)
    plan = StabilityPlan(parameters, BenchConfiguration(), {})
    for each in (point(15.0, 1.05), point(15.2, 0.99), point(15.6, None), point(16.0, 1.01)):
        plan.points.append(each)
    assert plan.next_middle() == Place(15.6, 1.01)
    plan.points.append(point(15.6, 1.0001))
    assert plan.next_middle() == Place(pytest.approx(15.4), 1.01)
    plan.points.extend((point(15.25, 1.001), point(15.1, 0.999)))
    assert plan.next_middle() is None


class _Measured(StabilityPlan):
    """A plan whose points have a given modulus at each frequency, without their steps."""

    def _point(self, place: Place, *_: object) -> Generator[Step, Outcome, StabilityPoint]:
        yield Publish(self._pace.progress("measuring", place.omega, 100))
        yield Publish(self._pace.progress("measuring after a fall", place.omega, 10))
        return point(place.omega, 1.0 + 0.1 * (place.omega - 15.33))


class _HeldOnce(StabilityPlan):
    """A plan in which the motion after the first start cannot be held, and the block falls after each later one."""

    def _held_point(
        self, _trial: object, fields: Mapping[str, Any], where: str
    ) -> Generator[Step, Outcome, tuple[StabilityPoint | None, bool]]:
        yield Publish(self._pace.progress("holding", 15.0, 100))
        if "start 1 of" not in where:
            return None, True
        update = {"status": OrbitStatus.NOT_HELD, "reason": "not captured"}
        return StabilityPoint.model_validate({**fields, **update}), False


def steps_of(plan: StabilityPlan) -> list[Step]:
    """All steps of a plan, answered by a bench whose motion is always the same."""
    steps, done = plan.steps(), list[Step]()
    step: Step | None = next(steps)
    while step is not None:
        done.append(step)
        made = Measured(tuple(cycle(k, 0.001) for k in range(step.cycles))) if isinstance(step, Dwell) else Done()
        try:
            step = steps.send(made)
        except StopIteration:
            step = None
    return done


def test_all_starts_are_counted_if_those_after_the_first_fall() -> None:
    start = Start("direct", (Segment(8.0, AMPLITUDE, 15.0),), 0.5)
    plan = _HeldOnce(StabilityParameters(omega=(15.0,)), BenchConfiguration(), {Place(15.0, 1.01): (start,) * 3})
    steps_of(plan)
    (found,) = plan.points
    assert (found.status, found.reason) == (OrbitStatus.NOT_HELD, "not captured")
    assert found.starts_tried == 3


def test_progress_through_a_bisection_never_goes_back_and_ends_with_its_last_point() -> None:
    parameters = StabilityParameters(omega=(15.0, 16.0), bracket=0.01)
    places = [Place(omega, 1.01) for omega in parameters.omega]
    start = Start("direct", (Segment(8.0, AMPLITUDE, 15.0),), 0.5)
    plan = _Measured(parameters, BenchConfiguration(), dict.fromkeys(places, (start,)))
    published = [step.event for step in steps_of(plan) if isinstance(step, Publish)]
    said = [event for event in published if isinstance(event, Progress)]
    assert len(plan.points) > 3
    fractions = [each.fraction for each in said]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert max(fractions[:-1]) < 1.0
    assert all(each.remaining > 0.0 for each in said[:-1])
    assert said[-1].remaining == 0.0


def test_a_design_exists_for_stable_orbits_too() -> None:
    assert prepared(orbit(16.0, 0.4), None, 1) is not None


def test_a_second_pair_of_nearly_equal_modulus_is_remarked() -> None:
    assert "second pair of multipliers, modulus 0.9736 at 148.8 degrees" in close_pair(orbit(15.6, 0.97))
    assert close_pair(orbit(15.0, 0.97)) == ""


def test_a_test_over_amplitude_is_one_after_its_first_point_too() -> None:
    curve = {
        "amplitude_factor": np.array([1.01, 1.1]),
        "omega_rad_s": np.array([15.3, 15.3]),
        "table_modulus": np.array([1.02, 0.98]),
        "fixed_modulus": np.array([1.03, 0.97]),
    }
    texts = boundary_texts([point(15.3, 1.02)], curve)
    assert "predicted boundary on the simulated table: 1.0550" in texts
    assert not any("rad/s" in text for text in texts)
