"""Sensitivities against re-solved orbits and against the scalings that the model's dimensions impose."""

from typing import Literal

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.gain import predict_gain
from sim.linear import steady_peaks
from sim.sensitivity import Sensitivity, budget, parameter_values, sensitivities
from sim.specimen import Block, Frame, Specimen
from sim.steady import NoOrbit, rocking_orbit
from tests.sim.runs import A_S

POINTS = [(0.40, 16.0), (0.25, 18.0), (0.64, 17.0), (0.97, 14.8)]
"""The last one is unstable."""


def scaled(found: dict[str, Sensitivity]) -> dict[str, np.ndarray]:
    """p d alpha / dp of alpha_1 and alpha_2, shape (2,), by name."""
    return {name: one.value * np.array([one.alpha_1, one.alpha_2]) for name, one in found.items()}


def specimen_from(values: dict[str, float]) -> Specimen:
    return Specimen(
        frame=Frame(**{name: values[name] for name in Frame.model_fields if name in values}),
        block=Block(**{name: values[name] for name in Block.model_fields}),
        beta=values["beta"],
        d=values["d"],
        g=values["g"],
    )


@pytest.mark.parametrize(("beta", "omega"), POINTS)
def test_against_orbits_solved_anew(beta: float, omega: float) -> None:
    specimen = Specimen(beta=beta)
    values, orbit = parameter_values(specimen, omega, A_S), rocking_orbit(specimen, omega, A_S)
    found = scaled(sensitivities(specimen, omega, A_S, orbit=orbit))
    assert set(found) == set(values)
    for name, value in values.items():
        gains: list[np.ndarray] = []
        for move in (1.0, -1.0, 2.0, -2.0):
            # small enough to keep the same one of the two sides' peaks the greater
            moved = {**values, name: value * (1.0 + 1e-6 * move)}
            there = (specimen_from(moved), moved["omega"], moved["amplitude"])
            peaks, bare = rocking_orbit(*there, orbit).peaks, steady_peaks(*there)
            gains.append(np.array([peaks.u1 / bare.u1, peaks.drift / bare.drift]))
        difference = (8.0 * (gains[0] - gains[1]) - (gains[2] - gains[3])) / 12e-6
        assert found[name] == pytest.approx(difference, rel=1e-6, abs=1e-7), name


@pytest.mark.parametrize("branch", ["rocking", "resting"])
def test_scalings_leave_the_gain_alone(branch: Literal["rocking", "resting"]) -> None:
    f = scaled(sensitivities(Specimen(beta=0.25), 18.5, A_S, branch))
    magnitude = max(float(np.abs(value).max()) for value in f.values())
    zero = pytest.approx(np.zeros(2), abs=1e-7 * magnitude)
    # the block's mass is rho 2b 2h_b s
    assert f["s"] - f["rho"] == zero
    # every force and every mass times one number
    assert f["k1"] + f["k2"] + f["m1"] + f["m2"] + f["rho"] == zero
    # every time times one number
    assert f["omega"] + 2.0 * (f["k1"] + f["k2"] + f["g"] + f["amplitude"]) == zero
    # every length times one number, the block's mass kept
    assert f["h1"] + f["d"] + f["b"] + f["h_b"] + f["g"] + f["amplitude"] - 2.0 * f["rho"] == zero


def test_an_uncoupled_block_has_no_say() -> None:
    for name, value in scaled(sensitivities(Specimen(beta=0.0), 16.0, A_S)).items():
        assert value == pytest.approx(np.zeros(2), abs=1e-7), name


def test_resting_branch_by_its_closed_form() -> None:
    specimen, omega, step = Specimen(beta=0.25), 18.5, 1e-5
    found = sensitivities(specimen, omega, A_S, "resting")
    # linear: the block and the amplitude do not matter
    for name in ("amplitude", "rho", "b", "h_b", "g", "d", "h1", "restitution_factor"):
        assert (found[name].alpha_1, found[name].alpha_2) == pytest.approx((0.0, 0.0), abs=1e-8), name
    mass, bare = 1.062, steady_peaks(specimen, omega, A_S)
    gains: list[complex] = []
    for beta in (0.25 - step, 0.25 + step):
        # the determinant of the 2x2 frame, typed out
        c1, c2 = specimen.frame.dashpots
        k1, k2 = 213.44, 56.45
        first = (1.0 + beta) * k1 + k2 - omega**2 * mass + 1j * omega * (c1 + c2)
        second, off = k2 - omega**2 * mass + 1j * omega * c2, -k2 - 1j * omega * c2
        determinant = first * second - off * off
        gains.append(abs(-A_S * mass * (second - off) / determinant) / bare.u1)
    assert found["beta"].alpha_1 == pytest.approx((gains[1] - gains[0]) / (2.0 * step), rel=1e-7)


def test_the_branch_must_exist() -> None:
    with pytest.raises(NoOrbit, match="lifts"):
        sensitivities(Specimen(beta=0.97), 16.0, A_S, "resting")
    with pytest.raises(InvalidInput, match="specimen"):
        sensitivities(Specimen(), 16.0, A_S)


def test_budget_adds_in_quadrature_and_correlated_parts_linearly() -> None:
    known = {"k1": Sensitivity(200.0, 0.3, -0.01), "d": Sensitivity(0.1, 0.4, 2.0), "g": Sensitivity(9.81, 1.0, 1.0)}
    alone = budget(known, {"k1": 10.0, "d": 10.0})
    assert (alone.alpha_1, alone.alpha_2) == pytest.approx((5.0, np.hypot(0.1, 20.0)))
    assert alone.contributions == {"k1": pytest.approx((3.0, 0.1)), "d": pytest.approx((4.0, 20.0))}
    together = budget(known, {"k1": 10.0, "d": 10.0}, {("d", "k1"): 1.0})
    assert (together.alpha_1, together.alpha_2) == pytest.approx((7.0, 19.9))
    assert budget(known, {"k1": 10.0, "d": 10.0}, {("d", "k1"): -0.5}).alpha_1 == pytest.approx(np.sqrt(13.0))
    assert budget(known, {}).alpha_1 == 0.0


def test_budget_is_the_scatter_of_a_sample() -> None:
    specimen, rng = Specimen(beta=0.4), np.random.default_rng(3)
    uncertain = {"k2": 0.05, "m2": 0.001, "amplitude": 0.002}
    predicted = budget(sensitivities(specimen, 16.0, A_S), uncertain)
    values, gains = parameter_values(specimen, 16.0, A_S), []
    for _ in range(150):
        moved = {**values, **{name: values[name] + size * rng.standard_normal() for name, size in uncertain.items()}}
        prediction = predict_gain(specimen_from(moved), 16.0, moved["amplitude"])
        assert prediction.rocking is not None
        gains.append(prediction.rocking.alpha_2)
    # a standard deviation from 150 values is known to 6 %
    assert np.std(gains) == pytest.approx(predicted.alpha_2, rel=0.25)


@pytest.mark.parametrize(
    ("uncertain", "correlation", "message"),
    [
        ({"colour": 1.0}, None, "colour"),
        ({"k1": -1.0}, None, "k1"),
        ({"k1": float("nan")}, None, "k1"),
        ({"k1": 1.0}, {("k1", "g"): 0.5}, "correlation"),
        ({"k1": 1.0, "g": 1.0}, {("k1", "g"): 1.5}, "correlation"),
        ({"k1": 1.0, "g": 1.0, "d": 1.0}, {("k1", "g"): 1.0, ("g", "d"): 1.0, ("k1", "d"): -1.0}, "correlation"),
    ],
)
def test_impossible_budgets_are_refused(
    uncertain: dict[str, float], correlation: dict[tuple[str, str], float] | None, message: str
) -> None:
    known = {name: Sensitivity(1.0, 1.0, 1.0) for name in ("k1", "g", "d")}
    with pytest.raises(InvalidInput, match=message):
        budget(known, uncertain, correlation)
