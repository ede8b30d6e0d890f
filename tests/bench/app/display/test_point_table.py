"""Quantities of any protocol have names, units and verdicts in its declared fields."""

import re
from math import isnan

import numpy as np

from bench.app.display.point_table import every_field, rows_of
from bench.app.formatting import ABSENT
from bench.datafile.tables import Column
from protocols.free_rocking.protocol import PROTOCOL as FREE_ROCKING

NONE = np.zeros(0)


def _columns(**declared: tuple[str, str]) -> dict[str, Column]:
    return {name: Column(NONE, unit, description) for name, (unit, description) in declared.items()}


def test_every_quantity_with_an_uncertainty_is_a_row() -> None:
    columns = _columns(
        decay=("1", "number of the decay, from 1; 0 for all decays together"),
        k1_n_m=("N/m", "stiffness of the first storey"),
        k1_uncertainty=("N/m", "expanded uncertainty (k = 2)"),
        alpha_rad=("rad", "critical angle from the motion"),
        alpha_uncertainty_rad=("rad", "expanded uncertainty of alpha_rad"),
        drift_peak_m=("m", "largest drift"),
    )
    point = {"decay": 1, "k1_n_m": 213.46, "k1_uncertainty": 0.33, "alpha_rad": 0.1236, "alpha_uncertainty_rad": 0.002,
             "drift_peak_m": 0.03}  # fmt: skip
    cells = [row.cells for row in rows_of(columns, [point])]
    assert cells[0][:3] == ("decay 1", "stiffness of the first storey", "(213.46 ± 0.33) N/m")
    assert cells[1][1:3] == ("critical angle from the motion", "(0.1236 ± 0.0020) rad")
    assert len(cells) == 2
    headings, rows = every_field(columns, [point])
    assert headings[1] == "k₁ [N/m]"
    assert (headings[-1], rows[0][-1]) == ("drift peak [mm]", "30")
    assert not re.search(r"[a-z0-9]_[a-z0-9]", " ".join([*headings, *(text for row in cells for text in row)]))


def test_a_nominal_value_is_compared_and_the_verdict_follows_both_uncertainties() -> None:
    columns = _columns(
        sensor=("", "channel"),
        scale=("1", "reading over true value"),
        scale_uncertainty=("1", "expanded uncertainty of the scale"),
        scale_predicted=("1", "predicted scale"),
        scale_predicted_uncertainty=("1", "its expanded uncertainty"),
    )
    near = {"sensor": "laser_1", "scale": 1.002, "scale_uncertainty": 0.003, "scale_predicted": 1.0,
            "scale_predicted_uncertainty": 0.001}  # fmt: skip
    good, bad = rows_of(columns, [near, near | {"scale": 1.01}])
    assert (good.point, good.agrees, bad.agrees) == ("laser 1", True, False)
    assert good.cells[4] == "+0.002 (+0.2 %)"


def test_a_point_without_a_verdict_of_its_own_has_none() -> None:
    columns = _columns(
        omega_rad_s=("rad/s", "frequency"),
        alpha_2=("1", "gain"),
        alpha_2_uncertainty=("1", "expanded uncertainty"),
        alpha_2_predicted=("1", "predicted gain"),
        alpha_2_predicted_uncertainty=("1", "its expanded uncertainty"),
        agrees=("", "whether both agree"),
    )
    modulated = {"omega_rad_s": 15.0, "alpha_2": 0.86, "alpha_2_uncertainty": 0.004, "alpha_2_predicted": 0.093,
                 "alpha_2_predicted_uncertainty": 0.03, "agrees": None}  # fmt: skip
    (row,) = rows_of(columns, [modulated])
    assert row.agrees is None
    # the prediction is that of an orbit on which the motion is not
    assert (row.cells[3], row.cells[4], isnan(row.score)) == ("0.093 ± 0.030", ABSENT, True)
    assert "+" not in row.sentence


def test_a_line_of_the_loop_check_has_its_own_unit() -> None:
    columns = _columns(
        subject=("", "channel"), what=("", "measured property"), verdict=("", "whether it passed"), unit=("", "unit"),
        measured=("of the row", ""), uncertainty=("of the row", ""), expected=("of the row", ""),
    )  # fmt: skip
    line = {"subject": "laser_1", "what": "delay against table_displacement", "verdict": "passed", "unit": "m/s2",
            "measured": 1.5, "uncertainty": None, "expected": None}  # fmt: skip
    (row,) = rows_of(columns, [line])
    assert row.cells == ("laser 1", "delay against table displacement", "1.500 m/s²", "-", "-", "passed")


def test_a_declared_name_replaces_the_formula_of_a_description() -> None:
    columns = _columns(
        part=("", "the tilt"),
        ratio=("1", "r_exp / r_th, the restitution factor"),
        ratio_uncertainty=("1", "expanded uncertainty of the ratio"),
    )
    point = {"part": "all tilts", "ratio": 1.01, "ratio_uncertainty": 0.02}
    (row,) = rows_of(columns, [point], FREE_ROCKING.view.labels)
    assert row.cells[1] == "restitution factor rₑₓₚ/rₜₕ"
