"""Grid of the gain map of a report."""

import pytest

from bench.document.gain_map import BETA_STEP, MOST, STEP, map_request
from bench.figures.map_figure import MapPoint


@pytest.mark.parametrize(("omega", "beta"), [(16.0, 0.4), (40.0, 0.4), (16.0, 4.0), (40.0, 4.0), (2.0, 0.02)])
def test_a_map_includes_the_measured_points_and_never_exceeds_its_bound(omega: float, beta: float) -> None:
    request = map_request(1.0, [MapPoint(omega, beta, "rocking", 1.2)])
    assert len(request.omega) * len(request.beta) <= MOST
    assert request.omega[0] <= omega <= request.omega[-1]
    assert request.beta[0] <= beta <= request.beta[-1]


def test_without_distant_points_the_spacing_is_that_of_the_default() -> None:
    request = map_request(1.0)
    assert request.omega[1] - request.omega[0] == pytest.approx(STEP)
    assert request.beta[1] - request.beta[0] == pytest.approx(BETA_STEP)
