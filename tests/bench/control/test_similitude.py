"""Scaled records: the model rocks as its prototype does, in scaled time; resampling moves no straight line."""

from dataclasses import dataclass
from math import hypot, pi, sqrt

import numpy as np
import pytest

from bench.analysis.table_motion import table_motion
from bench.control.preparation import resampled, scaled
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Block, Frame, Specimen

LENGTH = 0.37


@dataclass(frozen=True)
class RockingNumbers:
    """Numbers that model and prototype share; `p` [1/s], the scale of time, is not among them.

    `slenderness` h_b/b; `restitution`; `coupling` k_C/(M p^2); `frequencies` of the bare frame over p; `masses` m1/M
    and m2/M; `height` h1/h_b of the spring; `spring` d/b, its free length.
    """

    p: float
    slenderness: float
    restitution: float
    coupling: float
    frequencies: tuple[float, float]
    masses: tuple[float, float]
    height: float
    spring: float

    @staticmethod
    def of(specimen: Specimen) -> "RockingNumbers":
        """Those of a specimen."""
        frame, block = specimen.frame, specimen.block
        p = sqrt(block.mass * specimen.g * hypot(block.b, block.h_b) / block.inertia)
        lower, upper = frame.natural_frequencies
        return RockingNumbers(
            p=p,
            slenderness=block.slenderness,
            restitution=block.restitution,
            coupling=specimen.k_c / (block.mass * p * p),
            frequencies=(lower / p, upper / p),
            masses=(frame.m1 / block.mass, frame.m2 / block.mass),
            height=frame.h1 / block.h_b,
            spring=specimen.d / block.b,
        )


def pulse(dt: float = 0.01) -> SampledRecord:
    t = np.arange(501) * dt
    return SampledRecord(2.0 * np.sin(2.0 * pi * 1.3 * t) * np.sin(pi * t / t[-1]), dt)


def model_of(specimen: Specimen, length: float) -> Specimen:
    """Every length times lambda_L, the same density but for the depth: masses times lambda_L^3, stiffness m / t^2."""
    frame, block = specimen.frame, specimen.block
    mass = length**3
    return Specimen(
        frame=Frame(
            h1=frame.h1 * length,
            h2=frame.h2 * length,
            m1=frame.m1 * mass,
            m2=frame.m2 * mass,
            k1=frame.k1 * mass / length,
            k2=frame.k2 * mass / length,
            xi1=frame.xi1,
            xi2=frame.xi2,
        ),
        block=Block(b=block.b * length, h_b=block.h_b * length, s=block.s * length, rho=block.rho),
        beta=specimen.beta,
        d=specimen.d * length,
        g=specimen.g,
    )


def test_acceleration_is_kept_and_displacement_goes_with_length() -> None:
    record = pulse()
    small = scaled(record, LENGTH)
    assert np.array_equal(small.acceleration, record.acceleration)
    assert small.dt == pytest.approx(record.dt * sqrt(LENGTH))
    before, after = (table_motion(each.acceleration, each.dt) for each in (record, small))
    assert after.velocity == pytest.approx(sqrt(LENGTH) * before.velocity, abs=1e-13)
    assert after.displacement == pytest.approx(LENGTH * before.displacement, abs=1e-13)


def test_the_model_rocks_as_its_prototype_in_scaled_time() -> None:
    prototype = Specimen().coupled(0.64)
    model = model_of(prototype, LENGTH)
    record = pulse()
    small = scaled(record, LENGTH)
    times = np.linspace(0.0, record.duration, 101)
    large = simulate(prototype, record, sample_times=times)
    little = simulate(model, small, sample_times=np.minimum(times * sqrt(LENGTH), small.duration))
    assert large.impacts > 4
    assert little.impacts == large.impacts
    assert large.samples is not None
    assert little.samples is not None
    assert little.samples[:, 4] == pytest.approx(large.samples[:, 4], abs=1e-7)
    assert little.samples[:, :2] == pytest.approx(LENGTH * large.samples[:, :2], abs=1e-8)


def test_the_rocking_numbers_are_those_that_model_and_prototype_share() -> None:
    one, other = (RockingNumbers.of(each) for each in (Specimen(beta=0.4), model_of(Specimen(beta=0.4), LENGTH)))
    assert other.p == pytest.approx(one.p / sqrt(LENGTH))
    for name in ("slenderness", "restitution", "coupling", "frequencies", "masses", "height", "spring"):
        assert getattr(other, name) == pytest.approx(getattr(one, name)), name


def test_p_of_a_rectangular_block_is_housners() -> None:
    """p^2 = 3 g / (4 R) (Housner 1963)."""
    radius = sqrt(0.025**2 + 0.200**2)
    assert RockingNumbers.of(Specimen(beta=0.0)).p == pytest.approx(sqrt(3.0 * 9.81 / (4.0 * radius)))
    stiffer = RockingNumbers.of(Specimen(beta=0.5)).coupling
    assert stiffer == pytest.approx(0.5 * 213.44 / (2450.0 * 0.05 * 0.4 * 0.1 * 3.0 * 9.81 / (4.0 * radius)))


@pytest.mark.parametrize("parts", [1, 4, 7])
def test_a_step_that_divides_the_records_leaves_the_motion_as_it_is(parts: int) -> None:
    record = pulse()
    fine = resampled(record, record.dt / parts)
    assert fine.acceleration.size == 500 * parts + 1
    assert np.array_equal(fine.acceleration[::parts], record.acceleration)
    before, after = (table_motion(each.acceleration, each.dt) for each in (record, fine))
    assert after.displacement[::parts] == pytest.approx(before.displacement, abs=1e-13)


def test_any_other_step_keeps_every_sample_on_the_straight_lines() -> None:
    record = SampledRecord(np.array([0.0, 2.0, -2.0, 1.0]), 0.1)
    fine = resampled(record, 0.08)
    assert fine.acceleration == pytest.approx([0.0, 1.6, -0.4, -0.8, 0.0])
    assert fine.duration == pytest.approx(0.32)


def test_what_would_lose_or_turn_around_is_refused() -> None:
    record = pulse()
    with pytest.raises(InvalidInput, match="at most the record's step"):
        resampled(record, 1.5 * record.dt)
    with pytest.raises(InvalidInput, match="positive"):
        scaled(record, 0.0)
