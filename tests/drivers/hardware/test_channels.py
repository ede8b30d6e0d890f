"""From counts to values, for each kind of channel, against what a person calculates from data sheets."""

from dataclasses import dataclass

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from drivers.further import FurtherChannel
from drivers.hardware.channels import Scaling, analogue_channels, serial_laser
from drivers.hardware.parameters import (
    CoilCurrent,
    Hardware,
    Laser1,
    Laser2,
    Lasers,
    TableAcceleration,
    TableDisplacement,
    TableForce,
)
from drivers.optoncdt.codec import LASER_OFF, MEANINGS
from sim.channel import Channel


@dataclass(frozen=True)
class Converter:
    coefficients: tuple[float, ...]
    lowest: int
    highest: int


SIXTEEN = Converter((0.0, 10.0 / 32768), -32767, 32766)
"""+-10 V in 16 bits."""
TWENTY_FOUR = Converter((0.0, 10.0 / 2**23), -(2**23) + 1, 2**23 - 2)


def channels(*scalings: Scaling, **given: object) -> tuple[Channel, ...]:
    hardware = Hardware.model_validate({"lasers": Lasers(connection="analogue"), **given})
    return analogue_channels(hardware, scalings, {"device Dev1": "NI USB-6211"})


def value(channel: Channel, counts: int) -> float:
    return float(channel.to_unit(np.array([counts], dtype=np.int32))[0])


@pytest.mark.parametrize(
    ("name", "given", "counts", "expected"),
    [
        # 5 V at 16384 counts; (5 - 1) V / (100 V/m)
        ("table_displacement", TableDisplacement(sensitivity=100.0, zero=1.0), 16384, 0.040),
        ("table_displacement", TableDisplacement(sensitivity=-100.0, zero=1.0), 16384, -0.040),
        ("table_acceleration", TableAcceleration(sensitivity=0.5, zero=-0.5), 16384, 11.0),
        ("table_force", TableForce(sensitivity=0.01, zero=0.2), -16384, -520.0),
        ("coil_current", CoilCurrent(sensitivity=-0.2, zero=0.0), 16384, -25.0),
    ],
)
def test_a_transducer_is_zeroed_and_divided_by_its_sensitivity(
    name: str, given: object, counts: int, expected: float
) -> None:
    every = {"table_force": TableForce(), "coil_current": CoilCurrent(), name: given}
    made = {channel.name: channel for channel in channels(*[SIXTEEN] * 6, **every)}
    assert value(made[name], counts) == pytest.approx(expected, rel=1e-12)
    assert made[name].higher == ()
    assert np.isnan([value(made[name], 32767), value(made[name], -32768)]).all()


def test_the_polynomial_of_a_converter_is_applied_before_sensitivity_and_zero() -> None:
    """volts = 0.01 + 3e-4 n + 2e-10 n2 - 1e-15 n3; at n = 20000: 0.01 + 6 + 0.08 - 0.008 = 6.082 V."""
    curved = Converter((0.01, 3e-4, 2e-10, -1e-15), -32767, 32766)
    (one, *_) = channels(curved, *[SIXTEEN] * 3, table_displacement=TableDisplacement(sensitivity=-50.0, zero=0.082))
    assert value(one, 20_000) == pytest.approx(-0.12, rel=1e-12)


def test_a_converter_of_24_bits_needs_the_wider_integer() -> None:
    (one, *_) = channels(*[TWENTY_FOUR] * 4, table_displacement=TableDisplacement(sensitivity=100.0, zero=0.0))
    assert value(one, 2**22) == pytest.approx(0.05, rel=1e-12)
    assert one.storage is np.int32
    assert one.valid == (-(2**23) + 1, 2**23 - 2)


@pytest.mark.parametrize("slope", [1.0, -1.0])
@pytest.mark.parametrize("polarity", [1, -1])
@pytest.mark.parametrize(
    ("current", "expected"),
    [(4e-3, -0.05), (12e-3, 0.0), (16e-3, 0.025), (20e-3, 0.05), (3.0e-3, np.nan), (3.75e-3, np.nan)],
)
def test_a_laser_on_its_analogue_output(current: float, expected: float, polarity: int, slope: float) -> None:
    """4 to 20 mA over 400 ohm and 100 mm; 3 to 3.75 mA are no distance. A converter may count backwards."""
    converter = Converter((0.0, slope * 12.0 / 2**23), -(2**23) + 1, 2**23 - 2)
    *_, first, second = channels(
        SIXTEEN,
        SIXTEEN,
        converter,
        converter,
        lasers=Lasers(connection="analogue", load=400.0),
        laser_1=Laser1(measuring_range=0.1, polarity=polarity),
        laser_2=Laser2(measuring_range=0.2, polarity=1),
    )
    counts = round(slope * current * 400.0 * 2**23 / 12.0)
    assert value(first, counts) == pytest.approx(polarity * expected, abs=1e-7, nan_ok=True)
    assert value(second, counts) == pytest.approx(2.0 * expected, abs=2e-7, nan_ok=True)


def test_the_rail_of_the_converter_bounds_a_laser_as_well() -> None:
    """+-5 V end at 10 mA over 500 ohm, before the sensor's own end at 20.2 mA."""
    narrow = Converter((0.0, 5.0 / 32768), -32767, 32766)
    *_, first, _ = channels(SIXTEEN, SIXTEEN, narrow, narrow)
    assert first.valid == (round(1.9 * 32768 / 5.0), 32766)


@pytest.mark.parametrize("polarity", [1, -1])
def test_a_laser_read_serially(polarity: int) -> None:
    """Manual, p. 65: word 64877 of a sensor of 50 mm is 49.999496 mm, 24.999496 mm from mid range, word 32760."""
    one = serial_laser("laser_1", 0.050, polarity, "ILD1420-50", MEANINGS)
    assert value(one, 64877 - 32760) == pytest.approx(polarity * 24.999496e-3, abs=1e-9)
    assert value(one, 0) == 0.0
    assert value(one, 32760) == pytest.approx(polarity * 25.5e-3, rel=1e-12)
    assert np.isnan([value(one, count) for count in (*MEANINGS, 32761)]).all()
    assert "laser is off" in one.faults[LASER_OFF]


def test_channels_stand_in_the_order_of_the_inputs_with_quantity_and_unit() -> None:
    made = channels(*[SIXTEEN] * 6, table_force=TableForce(), coil_current=CoilCurrent())
    assert [(one.name, one.quantity, one.unit) for one in made] == [
        ("table_displacement", "displacement", "m"),
        ("table_acceleration", "acceleration", "m/s2"),
        ("table_force", "force", "N"),
        ("coil_current", "current", "A"),
        ("laser_1", "displacement", "m"),
        ("laser_2", "displacement", "m"),
    ]


@pytest.mark.parametrize("terminal", ["Dev1/ai0", "dev1/ai0", "DEV1/ai0"])
def test_the_device_of_a_terminal_is_found_in_any_case(terminal: str) -> None:
    (one, *_) = channels(*[SIXTEEN] * 4, table_displacement=TableDisplacement(terminal=terminal))
    assert one.device == f"NI USB-6211, {terminal}"


def test_a_device_that_nobody_described_is_said_to_be_unknown() -> None:
    (one, *_) = channels(*[SIXTEEN] * 4, table_displacement=TableDisplacement(terminal="Dev2/ai0"))
    assert one.device == "unknown device, Dev2/ai0"


def test_a_further_channel_is_a_row_after_those_of_every_bench() -> None:
    given = FurtherChannel(
        name="strain_of_spring",
        measures="strain",
        unit="1",
        place="elsewhere",
        terminal="Dev1/ai7",
        sensitivity=-250.0,
        zero=0.5,
    )
    hardware = Hardware.model_validate({"lasers": Lasers(connection="analogue")})
    made = analogue_channels(hardware, [SIXTEEN] * 5, {"device Dev1": "NI USB-6211"}, [given])
    assert [channel.name for channel in made[:2]] == ["table_displacement", "table_acceleration"]
    last = made[-1]
    assert (last.name, last.quantity, last.unit, last.device) == (
        *("strain_of_spring", "strain", "1"),
        "NI USB-6211, Dev1/ai7",
    )
    # 5 V at 16384 counts
    assert value(last, 16384) == pytest.approx((5.0 - 0.5) / -250.0, rel=1e-12)


def test_two_channels_on_one_terminal_are_refused() -> None:
    row = {"name": "a", "measures": "force", "unit": "N", "place": "elsewhere", "sensitivity": 1.0}
    with pytest.raises(ValueError, match=r"channels\[0\].terminal = 'Dev1/ai1' .* table_acceleration"):
        BenchConfiguration.model_validate({"backend": "hardware", "channels": [row | {"terminal": "Dev1/ai1"}]})
