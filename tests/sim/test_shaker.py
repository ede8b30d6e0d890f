from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from sim.filter_unit import FilterUnit
from sim.shaker import Shaker
from sim.specimen import Frame, Specimen
from sim.virtual_bench import Truth, VirtualBench, VirtualBenchParameters

LINEAR = Shaker(friction=0.0, force_noise=0.0)
FEATHER = Frame(m1=1e-9, m2=1e-9, k1=1e-6, k2=1e-6, xi1=0.01, xi2=0.01)
"""A frame that the table does not feel."""


def motion(shaker: Shaker, volts: NDArray[np.float64], rate: float, specimen: Specimen | None = None) -> Truth:
    """What the table really did under `volts`."""
    parameters = VirtualBenchParameters(sample_rate=rate, shaker=shaker, filter_unit=FilterUnit(cutoff=0.1 * rate))
    bench = VirtualBench(parameters, specimen or Specimen(frame=FEATHER), seed=1)
    bench.run(volts)
    return bench.truth


@pytest.mark.parametrize(
    "shaker",
    [
        LINEAR,
        LINEAR.model_copy(update={"amplifier_lag": 0.002}),
        LINEAR.model_copy(update={"amplifier": "current", "c_s": 400.0}),
    ],
    ids=["voltage", "voltage with lag", "current"],
)
@pytest.mark.parametrize("standing_block", [False, True], ids=["empty", "payload"])
def test_the_linear_response_is_the_closed_form(shaker: Shaker, standing_block: bool) -> None:
    """The drive is held between samples: (1 - exp(-i w T)) / (i w T) of its sine acts, its images are negligible."""
    rate, seconds = 5000.0, 6
    specimen = Specimen(frame=FEATHER, beta=0.0 if standing_block else None)
    payload = specimen.block.mass if standing_block else 0.0
    damping = shaker.c_s + shaker.electric_damping
    returns = np.roots([shaker.moving_mass + payload, damping, shaker.k_s])
    t = np.arange(int(seconds * rate)) / rate
    last = slice(int(rate), None)
    for omega in (12.5, 22.0):
        truth = motion(shaker, 0.4 * np.sin(omega * t), rate, specimen)
        # the transient is fitted beside the sine: it dies away slowly
        base = np.column_stack([np.sin(omega * t), np.cos(omega * t), *(np.exp(root * t) for root in returns)])
        (along, across, *_), *_ = np.linalg.lstsq(base[last], truth.x[last], rcond=None)
        hold = (1.0 - np.exp(-1j * omega / rate)) / (1j * omega / rate)
        expected = 0.4 * complex(shaker.frequency_response(omega, payload)) * hold / -(omega**2)
        assert abs(along + 1j * across - expected) < 1e-5 * abs(expected)
        assert np.abs(truth.theta).max() == 0.0


@pytest.mark.parametrize("amplifier", ["voltage", "current"])
def test_displacement_is_that_of_the_discretised_linear_system_to_rounding(
    amplifier: Literal["voltage", "current"],
) -> None:
    """scipy's zero-order hold is exact for a held drive."""
    shaker = Shaker(friction=0.0, force_noise=0.0, amplifier=amplifier, amplifier_lag=0.0)
    m, rate = shaker.moving_mass, 2000.0
    damping = shaker.c_s + (shaker.bl**2 / shaker.resistance if amplifier == "voltage" else 0.0)
    force = shaker.gain * shaker.bl / (shaker.resistance if amplifier == "voltage" else 1.0)
    continuous = (
        np.array([[0.0, 1.0], [-shaker.k_s / m, -damping / m]]),
        np.array([[0.0], [force / m]]),
        np.eye(2),
        np.zeros((2, 1)),
    )
    volts = 0.15 * np.random.default_rng(3).standard_normal(2000)
    discrete = signal.cont2discrete(continuous, 1.0 / rate, method="zoh")
    _, expected, _ = signal.dlsim(discrete, volts)
    truth = motion(shaker, volts, rate)
    scale = np.abs(expected).max(axis=0)
    assert np.abs(truth.x - expected[:, 0]).max() < 1e-8 * scale[0]
    assert np.abs(truth.v - expected[:, 1]).max() < 1e-8 * scale[1]


def test_the_drive_for_the_paper_is_a_sensible_part_of_the_range() -> None:
    """At A_s = 1.24 m/s2 the table moves at A_s / omega, and the back-EMF Bl v is most of the coil voltage."""
    shaker = Shaker()
    for omega in (12.5, 22.0):
        drive = shaker.drive_for(1.24, omega)
        back_emf = shaker.bl * 1.24 / omega / shaker.gain
        assert 0.1 <= drive / shaker.drive_range <= 0.4
        assert back_emf < drive < 1.1 * back_emf


def test_friction_distorts_a_sine_by_less_than_a_percent_but_visibly() -> None:
    """Third harmonic of the square wave F_c sign(v) over the impedance of the table (first order)."""
    shaker, omega, rate = Shaker(force_noise=0.0), 12.5, 2000.0
    t = np.arange(int(20 * rate)) / rate
    truth = motion(shaker, shaker.drive_for(1.24, omega) * np.sin(omega * t), rate)
    last = slice(-round(8 * 2 * np.pi / omega * rate), None)
    base = np.column_stack([f(k * omega * t[last]) for k in range(1, 8) for f in (np.sin, np.cos)])
    fitted, *_ = np.linalg.lstsq(base, truth.a[last], rcond=None)
    amplitudes = np.hypot(fitted[::2], fitted[1::2])
    third = 4.0 / (3.0 * np.pi) * shaker.friction * abs(complex(shaker.frequency_response(3.0 * omega)))
    assert amplitudes[2] == pytest.approx(third / shaker.force_per_volt, rel=0.05)
    assert 0.001 < amplitudes[2] / amplitudes[0] < 0.01


def test_the_amplifier_saturates_at_its_current_and_voltage() -> None:
    current = Shaker(friction=0, force_noise=0, k_s=0, c_s=0, amplifier="current", gain=4.0, current_limit=18.0)
    start = motion(current, np.full(20, 10.0), 2000.0)
    assert start.a[1:] == pytest.approx(np.full(19, 18.0 * 50.0 / 50.0), rel=1e-6)
    weak = Shaker(friction=0, force_noise=0, k_s=0, c_s=0, voltage_limit=6.0)
    long = motion(weak, np.full(1000, 10.0), 2000.0)
    assert long.v.max() == pytest.approx(6.0 / 50.0, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_end_stops_hold_the_table_under_full_drive(side: float) -> None:
    shaker = Shaker(force_noise=0.0)
    truth = motion(shaker, np.full(6000, 10.0 * side), 2000.0)
    reached = side * truth.x
    # an undamped stop takes up the kinetic energy and the force of the coil at standstill
    force = shaker.bl * shaker.current_limit
    speed = shaker.voltage_limit / shaker.bl
    deepest = force / shaker.stop_stiffness
    deepest += (deepest**2 + shaker.moving_mass * speed**2 / shaker.stop_stiffness) ** 0.5
    assert shaker.half_stroke < reached.max() < shaker.half_stroke + deepest
    holding = force - shaker.k_s * reached[-1]
    assert reached[-1] - shaker.half_stroke == pytest.approx(holding / shaker.stop_stiffness, rel=1e-3)


def test_force_noise_has_the_stated_density_at_any_rate() -> None:
    """A free mass under white force of one-sided density S: its velocity variance grows as S^2 t / (2 m^2)."""
    shaker = Shaker(k_s=0, c_s=0, friction=0, amplifier="current", force_noise=0.5, half_stroke=10)
    for rate in (500.0, 4000.0):
        truth = motion(shaker, np.zeros(int(100 * rate)), rate)
        steps = np.diff(truth.v[:: int(rate / 10)])
        assert steps.std() == pytest.approx(0.5 * (0.1 / 2.0) ** 0.5 / 50.0, rel=0.08)
