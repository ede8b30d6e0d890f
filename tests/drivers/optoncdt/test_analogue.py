"""The analogue output against the manual's currents."""

import pytest

from drivers.hardware.channels import laser_scaling, require_input_range
from sim.errors import InvalidInput
from sim.sensors import Laser


@pytest.mark.parametrize(
    ("current", "from_start"), [(4e-3, 0.0), (12e-3, 25e-3), (20e-3, 50e-3), (3.84e-3, -0.5e-3), (20.16e-3, 50.5e-3)]
)
@pytest.mark.parametrize("load", [250.0, 500.0])
def test_currents_are_those_of_the_manual(current: float, from_start: float, load: float) -> None:
    output = laser_scaling(0.050, load)
    assert (current * load - output.middle) * output.slope + 0.025 == pytest.approx(from_start, abs=1e-12)
    assert output.valid[0] < current * load < output.valid[1]


def test_three_volts_over_250_ohm_are_mid_range() -> None:
    assert laser_scaling(0.050, 250.0).middle == pytest.approx(3.0)


@pytest.mark.parametrize("error_current", [3.0e-3, 3.75e-3])
def test_the_error_current_is_not_a_distance(error_current: float) -> None:
    assert error_current * 500.0 < laser_scaling(0.2, 500.0).valid[0]


def test_the_simulated_sensor_has_the_same_output() -> None:
    simulated = Laser(measuring_range=0.2, load=500.0)
    output = laser_scaling(0.2, 500.0)
    assert (output.slope, -output.slope * output.middle) == pytest.approx(simulated.nominal)
    assert output.valid == pytest.approx(simulated.valid_volts)


def test_an_input_that_does_not_hold_all_distances_is_refused() -> None:
    require_input_range("hardware.laser_1.range", 10.0, 500.0)
    with pytest.raises(InvalidInput, match=r"hardware.laser_1.range = 5.0 .* 10 V across 500 ohm.* 250 ohm at most"):
        require_input_range("hardware.laser_1.range", 5.0, 500.0)
