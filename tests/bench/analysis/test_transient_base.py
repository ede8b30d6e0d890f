"""The table's motion from both of its sensors, against a motion that is known, and its error against what is stated."""

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.transient_base import base_motion
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Specimen

Array = NDArray[np.float64]

RATE, REST, SIZE = 2000.0, 4000, 40_000
T = np.arange(SIZE) / RATE
BELL = np.exp(-(((T - 9.0) / 2.5) ** 2))


def motion() -> tuple[Array, Array]:
    """Displacement [m] and its exact second derivative [m/s2], by complex exponentials under a bell."""
    x, a = np.zeros(SIZE), np.zeros(SIZE)
    for f, size, phase in ((1.1, 4e-3, 0.3), (2.7, 2e-3, 1.0), (8.0, 2e-4, 2.0), (20.0, 2e-5, 0.1)):
        w = 2.0 * np.pi * f
        s = 1j * w - 2.0 * (T - 9.0) / 2.5**2
        wave = size * BELL * np.exp(1j * (w * T + phase))
        x += wave.real
        a += (wave * (s**2 - 2.0 / 2.5**2)).real
    return x, a


X, A = motion()


def measured(random: np.random.Generator, scale: float = 1.0, late: int = 0) -> tuple[Array, Array]:
    """Signals with the virtual bench's noise, an offset that drifts, a table that ends elsewhere; and the rest."""
    signals = np.zeros((SIZE, 6))
    signals[:, 0] = A + 2e-4 * np.sqrt(RATE / 2.0) * random.standard_normal(SIZE) + np.linspace(0.0, 2e-3, SIZE)
    end = 1e-4 * T / T[-1]
    signals[:, 1] = scale * np.roll(X, late) + 5e-7 * np.sqrt(RATE / 2.0) * random.standard_normal(SIZE) + end
    return signals, signals[:REST]


def low(acceleration: Array, dt: float) -> float:
    """Root mean square between 0.5 and 2 Hz, where a frame's first mode is."""
    f = np.fft.rfftfreq(acceleration.size, dt)
    inside = (f > 0.5) & (f < 2.0)
    return float(np.sqrt(2.0 * np.sum(np.abs(np.fft.rfft(acceleration)[inside]) ** 2)) / acceleration.size)


def test_both_sensors_together_are_better_than_either_and_as_good_as_stated() -> None:
    random = np.random.default_rng(1)
    errors, alone, stated = [], [], []
    for _ in range(12):
        signals, rest = measured(random)
        found = base_motion(signals, rest, RATE)
        every = round(found.dt * RATE)
        errors.append(low(found.acceleration - A[::every], found.dt))
        alone.append(low(signals[:, 0] - A, 1.0 / RATE))
        stated.append(low(found.draw(random).acceleration - found.acceleration, found.dt))
        assert found.agreement == pytest.approx(1.0, abs=2e-3)
    together, apart, drawn = (np.sqrt(np.mean(np.square(each))) for each in (errors, alone, stated))
    assert together < 0.25 * apart
    assert drawn == pytest.approx(together, rel=0.5)


def test_the_response_of_the_frame_is_that_of_the_true_motion() -> None:
    signals, rest = measured(np.random.default_rng(2))
    found = base_motion(signals, rest, RATE)
    records = (SampledRecord(A[::2].copy(), 2.0 / RATE), found.record)
    true, seen = (simulate(Specimen(), record).peaks.drift for record in records)
    assert seen == pytest.approx(true, rel=1e-3)


def test_a_late_displacement_sensor_is_put_right() -> None:
    signals, rest = measured(np.random.default_rng(3), late=8)
    found = base_motion(signals, rest, RATE)
    f = np.fft.rfftfreq(found.acceleration.size, found.dt)
    inside = (f > 2.0) & (f < 4.0)
    wave = np.fft.rfft(found.acceleration)[inside]
    true = np.fft.rfft(A[:: round(found.dt * RATE)])[inside]
    # 4 ms would be 0.07 rad there
    assert abs(np.angle(np.vdot(true, wave))) < 0.005


@pytest.mark.parametrize("scale", [0.9, -1.0])
def test_sensors_that_disagree_leave_the_accelerometer_alone(scale: float) -> None:
    signals, rest = measured(np.random.default_rng(4), scale=scale)
    found = base_motion(signals, rest, RATE)
    assert found.agreement == pytest.approx(scale, rel=0.01)
    alone = np.sqrt(np.mean((found.acceleration - A[:: round(found.dt * RATE)]) ** 2))
    assert alone < 0.01
    assert found.acceleration.size == SIZE // 2


@pytest.mark.parametrize("step", [4e-6, 2e-5])
@pytest.mark.parametrize("noise", [0.0, 1e-7, 1.0])
@pytest.mark.parametrize("size", [1.0, 0.1])
def test_a_sensor_that_is_quieter_than_its_steps_counts_for_no_better(step: float, noise: float, size: float) -> None:
    """Half a step of error that is not to be seen at rest, at every place within a step; a noise of 1 is one step."""
    random = np.random.default_rng(6)
    errors, wide, alone, stated = [], [], [], []
    for place in np.linspace(-0.5, 0.5, 6, endpoint=False):
        signals = np.zeros((SIZE, 6))
        signals[:, 0] = size * A + 2e-4 * np.sqrt(RATE / 2.0) * random.standard_normal(SIZE)
        seen = size * X + max(noise * (step if noise == 1.0 else 1.0), 1e-12) * random.standard_normal(SIZE)
        signals[:, 1] = step * np.round(seen / step + place)
        found = base_motion(signals, signals[:REST], RATE)
        every = round(found.dt * RATE)
        errors.append(low(found.acceleration - size * A[::every], found.dt))
        wide.append(np.std(found.acceleration - size * A[::every]))
        alone.append(low(signals[:, 0] - size * A, 1.0 / RATE))
        stated.append(low(found.draw(random).acceleration - found.acceleration, found.dt))
    together, apart, drawn = (np.sqrt(np.mean(np.square(each))) for each in (errors, alone, stated))
    assert together < 0.6 * apart
    # the accelerometer's own: 2e-4 (m/s2)/Hz^(1/2) up to 400 Hz
    assert np.mean(wide) == pytest.approx(2e-4 * np.sqrt(400.0), rel=0.03)
    # never better than it is, and at most twice as bad
    assert 0.85 * together < drawn < 2.0 * together


def test_a_coarse_accelerometer_is_not_believed_more_than_its_steps() -> None:
    """A step of 0.02 m/s2 without any noise: the displacement sensor is the better one where the frame answers."""
    random = np.random.default_rng(7)
    signals, _ = measured(random)
    signals[:, 0] = 0.02 * np.round(A / 0.02 + 0.3)
    found = base_motion(signals, signals[:REST], RATE)
    every = round(found.dt * RATE)
    error = low(found.acceleration - A[::every], found.dt)
    assert error < 0.2 * low(signals[:, 0] - signals[0, 0] - A, 1.0 / RATE)
    drawn = [low(found.draw(random).acceleration - found.acceleration, found.dt) for _ in range(8)]
    assert np.mean(drawn) == pytest.approx(error, rel=0.6)


def test_missing_samples_are_refused() -> None:
    signals, rest = measured(np.random.default_rng(5))
    signals[20_000, 1] = np.nan
    with pytest.raises(InvalidInput, match="every sample of both"):
        base_motion(signals, rest, RATE)
