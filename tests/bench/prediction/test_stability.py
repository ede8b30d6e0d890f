"""Boundaries of stability against frequency: the orbits at their two sides, and the command."""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.contour import ContourSet

from bench.app.cli.main import main
from bench.figures.stability_figure import boundary_figure
from bench.prediction.requests import StabilityRequest
from bench.prediction.stability import (
    BOUNDARY,
    StabilityPoint,
    boundaries_table,
    points_table,
    stability_boundaries,
    stability_points,
)
from sim.knowledge import SpecimenKnowledge
from sim.multiplier_sensitivity import fixed_slopes
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import rocking_orbit
from sim.table_orbit import table_orbit

ASKED = StabilityRequest(omega=(13.2, 12.2, 12.7), beta=(0.64,), harmonics=1)
AMPLITUDE = ASKED.amplitude_factor[0] * Specimen().uplift_acceleration
KNOWN = SpecimenKnowledge()
WEAK = Shaker(voltage_limit=0.5)
"""It cannot move the table, of which nothing is computed then."""


@pytest.fixture(scope="module")
def beyond_the_shaker() -> list[StabilityPoint]:
    return stability_points(Specimen(), WEAK, ASKED)


def stable(omega: float, ground: str) -> bool:
    orbit = rocking_orbit(Specimen().coupled(0.64), omega, AMPLITUDE)
    return orbit.stable if ground == "fixed ground" else table_orbit(orbit, Shaker(), ASKED.harmonics).stable


def test_the_motion_is_stable_on_one_side_of_each_boundary() -> None:
    points = stability_points(Specimen(), Shaker(), ASKED)
    assert [each.orbit.omega for each in points] == [12.2, 12.7, 13.2]
    found = boundaries_table(stability_boundaries(Specimen(), Shaker(), KNOWN, ASKED, points))
    assert found["ground"].values.tolist() == ["fixed ground"] * 2 + ["table"] * 2
    assert found["kind"].values.tolist() == ["Neimark-Sacker"] * 4
    for k, (omega, ground) in enumerate(zip(found["omega_rad_s"].values, found["ground"].values, strict=True)):
        sides = [stable(float(omega) + side, str(ground)) for side in (-BOUNDARY, BOUNDARY)]
        assert sides == ([True, False] if k % 2 == 0 else [False, True])


def test_a_lighter_table_moves_the_boundary(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "12.3", "12.7", "--beta", "0.64", "--harmonics", "1", "--json"]
    found = list[float]()
    for mass in ("20", "50"):
        assert main(["predict", "stability", *flags, "--table-mass", mass]) == 0
        rows = json.loads(capsys.readouterr().out)["boundaries"]
        assert [row["ground"] for row in rows] == ["fixed ground", "table"]
        found += [row["omega_rad_s"] for row in rows]
    assert found[0] == found[2] < found[1] < found[3]


def test_a_table_that_is_too_heavy_for_the_shaker_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "12.3", "12.5", "--beta", "0.64", "--table-mass", "3000", "--json"]
    assert main(["predict", "stability", *flags]) == 0
    told = capsys.readouterr()
    assert "points at which the shaker cannot move this table as requested: 2" in told.err
    assert [row["table_modulus"] for row in json.loads(told.out)["points"]] == [None, None]


def test_no_boundary_is_said_and_the_multipliers_are_still_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["--omega", "16", "17", "--beta", "0.64", "--csv", str(tmp_path / "points.csv")]
    assert main(["predict", "stability", *flags, "--plot", str(tmp_path / "stability.png")]) == 0
    assert "there is no stability boundary in the range" in capsys.readouterr().out
    assert (tmp_path / "stability.png").stat().st_size > 1000
    (points,) = (path for path in tmp_path.iterdir() if path.suffix == ".csv" and "points" in path.name)
    rows = np.genfromtxt(points, delimiter=",", names=True)
    np.testing.assert_array_less(rows["table_modulus"], 1.0)


def test_where_the_shaker_cannot_move_the_table_only_fixed_ground_is_known(
    beyond_the_shaker: list[StabilityPoint],
) -> None:
    points = points_table(beyond_the_shaker)
    assert np.isnan(points["table_modulus"].values).all()
    assert np.isfinite(points["modulus"].values).all()
    found = stability_boundaries(Specimen(), WEAK, KNOWN, ASKED, beyond_the_shaker)
    assert {each.ground for each in found} == {"fixed ground"}


def test_boundaries_state_their_sensitivities_and_the_uncertainty_from_the_specimen() -> None:
    request = ASKED.model_copy(update={"omega": (12.2, 12.7)})
    orbits = stability_points(Specimen(), WEAK, request)
    (found,) = stability_boundaries(Specimen(), WEAK, KNOWN, request, orbits)
    orbit = rocking_orbit(Specimen().coupled(0.64), found.omega, AMPLITUDE)
    slopes, half_widths = fixed_slopes(orbit), {"k1": 0.05, "k2": 0.05, "xi1": 0.3, "xi2": 0.3, "k_c": 0.1}
    half_widths["restitution_factor"] = 0.01
    # uniform distributions have the standard uncertainty of their half width over the root of 3
    parts = {name: abs(slopes.boundary[name]) * width / 3.0**0.5 for name, width in half_widths.items()}
    assert found.uncertainty == pytest.approx(np.hypot.reduce(list(parts.values())), rel=1e-3)
    assert found.largest == max(parts, key=parts.__getitem__) == "k1"
    table = boundaries_table([found])
    assert table["omega_by_restitution_rad_s"].values[0] == pytest.approx(
        slopes.boundary["restitution_factor"], rel=1e-3
    )
    assert table["modulus_by_k_c"].values[0] == pytest.approx(slopes.modulus["k_c"], rel=1e-3)
    assert np.isnan(table["omega_by_table_mass_rad_s"].values[0])


def test_sensitivities_of_every_point_are_columns_of_the_points(beyond_the_shaker: list[StabilityPoint]) -> None:
    request = ASKED.model_copy(update={"omega": (12.5, 12.6), "sensitivity": True, "harmonics": 1})
    orbits = stability_points(Specimen(), WEAK, request)
    table = points_table(orbits)
    expected = [fixed_slopes(each.orbit).modulus["amplitude"] for each in orbits]
    assert table["modulus_by_amplitude"].values.tolist() == pytest.approx(expected, rel=1e-9)
    assert "table_modulus_by_amplitude" not in table
    assert "modulus_by_amplitude" not in points_table(beyond_the_shaker)


def test_boundaries_over_stiffness_and_amplitude(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = [
        "--omega",
        "12.0",
        "12.7",
        "--beta",
        "0.6",
        "0.64",
        "--amplitude-factor",
        "1.01:1.05:2",
        "--harmonics",
        "1",
    ]
    plot = tmp_path / "boundaries.png"
    assert main(["predict", "stability", *flags, "--table-mass", "3000", "--json", "--plot", str(plot)]) == 0
    found = json.loads(capsys.readouterr().out)
    curves = [(0.6, 1.01), (0.6, 1.05), (0.64, 1.01), (0.64, 1.05)]
    assert [(row["beta"], row["amplitude_factor"]) for row in found["points"]] == [
        each for each in curves for _ in "12"
    ]
    assert [(row["beta"], row["amplitude_factor"]) for row in found["boundaries"]] == curves
    for row in found["boundaries"]:
        amplitude = row["amplitude_factor"] * Specimen().uplift_acceleration
        sides = [
            rocking_orbit(Specimen().coupled(row["beta"]), row["omega_rad_s"] + side, amplitude).stable
            for side in (-BOUNDARY, BOUNDARY)
        ]
        assert sides == [True, False]
    assert found["known"]["stiffness"] == 0.05
    assert plot.stat().st_size > 10_000


def test_the_curves_of_the_figure_pass_through_the_located_boundaries() -> None:
    beta, omega = np.repeat([0.6, 0.8], 3), np.tile([12.0, 13.0, 14.0], 2)
    moduli = np.array([0.9, 1.1, 1.2, 0.9, 0.95, 1.3])
    points = {"beta": beta, "omega_rad_s": omega, "modulus": moduli, "amplitude_factor": np.full(6, 1.1)}
    points["table_modulus"] = np.full(6, np.nan)
    located = {"beta": np.array([0.6, 0.8]), "omega_rad_s": np.array([12.7, 13.2]), "amplitude_factor": np.full(2, 1.1)}
    located["ground"] = np.array(["fixed ground"] * 2)
    first, second = boundary_figure(points, located).axes
    (curve,) = (each for each in first.collections if isinstance(each, ContourSet))
    (path,) = curve.get_paths()
    for place in ((0.6, 12.7), (0.8, 13.2)):
        assert np.abs(np.asarray(path.vertices) - place).max(axis=1).min() < 1e-9
    assert not second.collections
