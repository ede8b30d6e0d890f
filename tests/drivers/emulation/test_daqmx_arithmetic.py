"""Rates, names and counts of the emulated devices, against what their manuals and plain arithmetic say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.emulation.daqmx.device import AnalogInputs, InputConverter, Wirings
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.models import unflattened
from drivers.emulation.daqmx.timing import sample_clock
from sim.sensors import Converter


@pytest.mark.parametrize(
    ("asked", "made"),
    [
        (2000.0, 2000.0),
        (1000.0, 1000.0),
        (1001.0, 2000.0),
        (999.0, 1000.0),
        (600.0, 2000.0 / 3.0),
        (2000.0 / 3.0, 2000.0 / 3.0),
        (1.0, 1.0),
        (5000.0, 2000.0),
    ],
)
def test_a_rate_becomes_the_next_higher_fraction_of_the_clock(asked: float, made: float) -> None:
    clock = sample_clock(asked, 1.0e6, 2000.0, 100)
    assert clock.rate == pytest.approx(made, rel=1e-12)
    assert clock.rate * clock.divider == pytest.approx(2000.0, rel=1e-12)


def test_a_rate_stays_below_the_highest_of_the_device() -> None:
    assert sample_clock(700.0, 700.0, 2000.0, 100).rate == pytest.approx(2000.0 / 3.0)


@pytest.mark.parametrize("asked", [0.0, -1.0, 1001.0, float("nan")])
def test_a_rate_that_the_device_has_not_is_refused(asked: float) -> None:
    with pytest.raises(DaqmxFailure) as failure:
        sample_clock(asked, 1000.0, 2000.0, 100)
    assert failure.value.code.value == -200077


@pytest.mark.parametrize(
    ("names", "single"),
    [
        ("Dev1/ai0", ["Dev1/ai0"]),
        ("Dev1/ai0:2", ["Dev1/ai0", "Dev1/ai1", "Dev1/ai2"]),
        ("Dev1/ai2:0", ["Dev1/ai2", "Dev1/ai1", "Dev1/ai0"]),
        ("Dev1/ai0, Dev1/ai4:5", ["Dev1/ai0", "Dev1/ai4", "Dev1/ai5"]),
        ("Dev1/ai0:Dev1/ai1", ["Dev1/ai0", "Dev1/ai1"]),
        ("cRIO1Mod4/port0/line6:7", ["cRIO1Mod4/port0/line6", "cRIO1Mod4/port0/line7"]),
        ("", []),
    ],
)
def test_lists_of_channels_are_taken_apart(names: str, single: list[str]) -> None:
    assert list(unflattened(names)) == single


def inputs_of(resolution: int, polynomial: tuple[float, ...] | None = None) -> AnalogInputs:
    return AnalogInputs(
        count=1,
        ranges=(10.0, 5.0),
        rate=1e6,
        total_rate=1e6,
        simultaneous=True,
        wirings=Wirings.DIFFERENTIAL,
        resolution=resolution,
        raw_bits=16 if resolution <= 16 else 32,
        polynomials={} if polynomial is None else {0: polynomial},
    )


ALL = np.arange(-(2**15), 2**15, dtype=np.int32)


def test_a_device_like_the_plants_converter_gives_its_counts() -> None:
    converter = InputConverter(inputs_of(16), 0, 10.0, Converter(bits=16, range=10.0))
    raw = converter.raw(ALL.astype(np.int16))
    assert raw.dtype == np.int16
    assert (raw == ALL).all()


def test_a_finer_device_gives_more_counts_for_the_same_volts_and_saturates_with_the_plant() -> None:
    raw = InputConverter(inputs_of(24), 0, 10.0, Converter(bits=16, range=10.0)).raw(ALL.astype(np.int16))
    assert raw.dtype == np.int32
    assert (raw[1:-1] == 256 * ALL[1:-1]).all()
    assert (raw[0], raw[-1]) == (-(2**23), 2**23 - 1)


def test_a_narrower_range_is_finer_and_ends_earlier() -> None:
    raw = InputConverter(inputs_of(16), 0, 5.0, Converter(bits=16, range=10.0)).raw(ALL.astype(np.int16))
    inside = np.abs(ALL) < 2**14
    assert (raw[inside] == 2 * ALL[inside]).all()
    assert (raw[ALL < -(2**14)] == -(2**15)).all()
    assert (raw[ALL >= 2**14] == 2**15 - 1).all()


@settings(max_examples=20, deadline=None)
@given(
    offset=st.floats(-0.01, 0.01),
    slope=st.floats(0.98, 1.02),
    square=st.floats(-1e-3, 1e-3),
    cube=st.floats(-1e-3, 1e-3),
)
def test_the_calibration_polynomial_gives_the_volts_back(
    offset: float, slope: float, square: float, cube: float
) -> None:
    lsb, full = 20.0 / 65536.0, 32768.0
    # bent by up to 10 mV at the ends of the range
    polynomial = (offset, slope * lsb, 10.0 * square / full**2, 10.0 * cube / full**3)
    converter = InputConverter(inputs_of(16, polynomial), 0, 10.0, Converter(bits=16, range=10.0))
    plant = np.arange(-31000, 31001, 7, dtype=np.int16)
    volts = np.polynomial.Polynomial(polynomial)(converter.raw(plant).astype(float))
    assert np.abs(volts - plant * lsb).max() <= 0.52 * lsb
    assert converter.volts(converter.raw(plant)) == pytest.approx(volts, abs=1e-12)
