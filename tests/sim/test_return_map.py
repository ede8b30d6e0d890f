"""Fixed points of the return map: rows of points that are not found."""

import numpy as np
import pytest

from sim import return_map
from sim.specimen import Specimen
from sim.steady import rocking_orbit

ORBIT = rocking_orbit(Specimen().coupled(0.4), 16.0, 1.01 * Specimen().uplift_acceleration)


def test_a_point_without_a_finite_jacobian_is_not_found_and_its_row_is_nan(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = return_map.jacobians

    def one_lost(q: np.ndarray, x: np.ndarray, accuracy: return_map.Accuracy) -> np.ndarray:
        found = exact(q, x, accuracy)
        found[0, 3, 3] = np.nan
        return found

    of_one = return_map.parameters(ORBIT.specimen, ORBIT.omega, ORBIT.amplitude)
    q, x = np.repeat(of_one, 2, axis=0), np.repeat(ORBIT.section[None], 2, axis=0)
    known = exact(q, x, 4)
    monkeypatch.setattr(return_map, "jacobians", one_lost)
    solutions = return_map.newton(q, x, known)
    assert solutions.found.tolist() == [False, True]
    for each in (solutions.section, solutions.jacobian, solutions.peaks):
        assert np.isnan(each[0]).all()
        assert np.isfinite(each[1]).all()
