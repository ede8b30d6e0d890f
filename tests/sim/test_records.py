"""Records: a resting block or a bare frame by the exact step, rocking sample by sample, peaks between the samples.

The truth at rest is scipy's exponential of the augmented matrix, evaluated as finely as a test needs.
"""

from itertools import pairwise
from math import isnan

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from sim.excitation import ROW, Excitation, SampledRecord, SineProgram, Sweep
from sim.linear import frame_matrices
from sim.rocking import Mode, State, Status, simulate
from sim.specimen import Frame, Specimen
from tests.sim.runs import A_S

COUPLED = Specimen(beta=0.64)


class Rows:
    """An excitation made of any rows."""

    def __init__(self, rows: NDArray[np.float64]) -> None:
        self._rows = rows
        self.duration = float(rows[:, 0].sum())

    def packed(self) -> NDArray[np.float64]:
        return self._rows


def noise(seed: int, count: int, amplitude: float) -> NDArray[np.float64]:
    """A smooth random record, greatest value `amplitude` [m/s2]."""
    values = np.convolve(np.random.default_rng(seed).standard_normal(count), np.hanning(9), "same")
    return values * (amplitude / np.abs(values).max())


def augmented(specimen: Specimen) -> NDArray[np.float64]:
    """d/dt [u1, u2, v1, v2, a_g, a_g'] of the frame with the block at rest, shape (6, 6)."""
    mass, damping, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    system = np.zeros((6, 6))
    system[:2, 2:4] = np.eye(2)
    system[2:4, :2], system[2:4, 2:4] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    system[2:4, 4], system[4, 5] = -1.0, 1.0
    return system


def resting(specimen: Specimen, values: NDArray[np.float64], dt: float, parts: int = 1) -> NDArray[np.float64]:
    """[u1, u2, v1, v2, a_g, a_g'] at `parts` equal parts of every interval, from rest, shape (n, 6)."""
    z, step, found = np.zeros(6), expm(augmented(specimen) * (dt / parts)), []
    for value, following in pairwise(values):
        z[4:] = value, (following - value) / dt
        for _ in range(parts):
            found.append(z.copy())
            z = step @ z
    return np.array([*found, z])


@pytest.mark.parametrize("specimen", [Specimen(), COUPLED, Specimen(beta=0.0), Specimen(beta=3.0)])
@pytest.mark.parametrize("dt", [0.001, 0.005, 0.02])
def test_a_record_at_rest_is_the_matrix_exponential_to_rounding(specimen: Specimen, dt: float) -> None:
    values = noise(1, 2001, 0.3)
    motion = simulate(specimen, SampledRecord(values, dt), sample_times=dt * np.arange(2001), tolerance=1e-13)
    truth = resting(specimen, values, dt)[:, :4]
    assert motion.samples is not None
    assert motion.peaks.theta == motion.impacts == 0
    assert np.abs(motion.samples[:, :4] - truth).max() < 2e-13 * np.abs(truth).max()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("specimen", [Specimen(), COUPLED])
def test_peaks_between_the_samples_are_exact(specimen: Specimen, seed: int) -> None:
    dt, parts = 0.02, 400
    values = noise(seed, 120, 0.4)
    fine = resting(specimen, values, dt, parts)
    motion = simulate(specimen, SampledRecord(values, dt), tolerance=1e-13)
    between = False
    for found, displacement, velocity in (
        (motion.peaks.u1, fine[:, 0], fine[:, 2]),
        (motion.peaks.drift, fine[:, 1] - fine[:, 0], fine[:, 3] - fine[:, 2]),
    ):
        at = int(np.abs(displacement).argmax())
        # a scan is low by at most |acceleration| (half a part)^2 / 2
        curvature = np.abs(np.gradient(velocity, dt / parts)).max()
        assert 0.0 <= found - abs(displacement[at]) + 1e-15 <= curvature * (0.5 * dt / parts) ** 2 / 2.0 + 2e-15
        between = between or np.abs(displacement[::parts]).max() < found * (1.0 - 1e-6)
    assert between  # else the record shows nothing


def test_peaks_of_a_window_that_opens_inside_an_interval() -> None:
    dt, parts = 0.02, 400
    values = noise(3, 120, 0.4)
    fine = resting(COUPLED, values, dt, parts)
    # opens while |u1| falls from its greatest value: the peak is the value there, or a later one
    opens = int(np.abs(fine[:, 0]).argmax()) + 37
    motion = simulate(COUPLED, SampledRecord(values, dt), peaks_from=opens * dt / parts)
    assert motion.peaks.u1 == pytest.approx(np.abs(fine[opens:, 0]).max(), rel=1e-7)


@pytest.mark.parametrize("seed", range(8))
def test_the_block_lifts_exactly_when_the_moment_reaches_it_even_between_samples(seed: int) -> None:
    dt, parts, block = 0.02, 400, COUPLED.block
    values = noise(seed, 60, 1.0)
    fine = resting(COUPLED, values, dt, parts)
    moment = np.abs(block.h_b * block.mass * fine[:, 4] - COUPLED.k_c * COUPLED.frame.h1 * fine[:, 0])
    # a_g jumps in slope at the samples: its value there belongs to both intervals, u1 bends in between
    critical = block.b * COUPLED.g * block.mass / moment.max()
    for factor, lifts in ((1.0 - 1e-5, False), (1.0 + 1e-5, True)):
        motion = simulate(COUPLED, SampledRecord(values * critical * factor, dt))
        assert (motion.peaks.theta > 0.0) is lifts


def test_an_uplift_between_two_quiet_samples_is_seen() -> None:
    # u1 swings by itself and lifts the block at its extreme, halfway between samples of a base that does not move
    specimen, dt = Specimen(beta=0.64), 0.04
    block = specimen.block
    holding = block.b * specimen.g * block.mass / (specimen.k_c * specimen.frame.h1)
    step = expm(augmented(specimen) * 1e-5)
    z, path = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]), []
    for _ in range(12_000):
        z = step @ z
        path.append(z[0])
    top = int(np.argmax(path)) + 1
    scale = holding / path[top - 1]
    # so timed that the extreme falls in the middle of the second interval
    drive = Rows(np.array([[top * 1e-5 - 0.5 * dt, *[0.0] * 9], *[[dt, *[0.0] * 9]] * 2]))
    for factor, lifts in ((0.9999, False), (1.0001, True)):
        start = State(v1=scale * factor, v2=scale * factor)
        motion = simulate(specimen, drive, state=start)
        assert (motion.peaks.theta > 0.0) is lifts
        assert motion.peaks.u1 == pytest.approx(holding * factor, rel=1e-3)


def mixed() -> Rows:
    """Straight rows of several lengths, each more than once, with a sine between them; all below uplift."""
    rows = np.zeros((60, ROW))
    rows[:, 0] = np.repeat([0.01, 0.02, 0.01, 0.005], 15)
    rows[:, 8], rows[:, 9] = noise(5, 60, 0.3), noise(6, 60, 2.0)
    rows[20, 1], rows[20, 6] = 0.1, 11.0
    rows[41, 2], rows[41, 6] = 0.5, 30.0
    return Rows(rows)


def test_rows_of_any_length_and_sines_among_them() -> None:
    drive = mixed()
    z, system = np.zeros(6), augmented(COUPLED)
    for row in drive.packed():
        # a sine as two more states: a'' = -omega^2 a; P_1 t sin is left to small pieces of straight lines
        pieces = 1 if row[1] == row[2] == 0.0 else 4000
        edges = np.linspace(0.0, row[0], pieces + 1)
        base = (row[1] + row[2] * edges) * np.sin(row[6] * edges) + row[8] + row[9] * edges
        step = expm(system * (row[0] / pieces))
        for value, following in pairwise(base):
            z[4:] = value, (following - value) * pieces / row[0]
            z = step @ z
    motion = simulate(COUPLED, drive, tolerance=1e-13)
    assert motion.end.mode is Mode.REST
    assert motion.end.as_array()[:4] == pytest.approx(z[:4], abs=1e-10)


def test_a_stiff_frame_under_a_coarse_record_is_stepped_not_glided() -> None:
    # 2 pi of phase and more in one interval: no polynomial of the order in use covers it
    stiff = Specimen(frame=Frame(k1=2e5, k2=5e4))
    values, dt = noise(2, 60, 1.0), 0.05
    motion = simulate(stiff, SampledRecord(values, dt), tolerance=1e-13)
    truth = resting(stiff, values, dt)
    assert motion.steps > 2 * values.size
    assert motion.end.as_array()[:4] == pytest.approx(truth[-1, :4], abs=1e-12)


def drives() -> list[Excitation]:
    t = 0.005 * np.arange(1200)
    return [
        SampledRecord(noise(4, 1200, 0.3), 0.005),
        SampledRecord(2.0 * A_S * np.sin(17.0 * t) * np.sin(0.5 * t), 0.005),
        SineProgram([Sweep.dwell(6.0, 1.2 * A_S, 17.0)]),
        mixed(),
    ]


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("specimen", [Specimen(), COUPLED])
def test_what_is_asked_for_does_not_move_the_motion(specimen: Specimen, which: int) -> None:
    drive = drives()[which]
    plain = simulate(specimen, drive, peaks_from=None)
    times = np.sort(np.random.default_rng(7).uniform(0.0, drive.duration, 700))
    asked = simulate(specimen, drive, sample_times=times)
    assert plain.end == asked.end
    assert (plain.impacts, plain.steps, plain.end_time) == (asked.impacts, asked.steps, asked.end_time)
    assert isnan(plain.peaks.u1)
    assert isnan(plain.peaks.theta)
    assert asked.peaks.u1 > 0.0


def test_a_record_costs_one_step_a_sample_and_two_at_an_event() -> None:
    dt = 0.005
    for seconds in (10.0, 20.0, 40.0):
        samples = round(seconds / dt)
        at_rest = simulate(COUPLED, SampledRecord(noise(1, samples + 1, 0.3), dt))
        assert at_rest.steps == samples
        t = dt * np.arange(samples + 1)
        orbit = State(-0.0010828, 0.00037455, 0.049398, -0.11073, 0.0, 0.67994)
        rocking = simulate(Specimen(beta=0.4), SampledRecord(A_S * np.sin(16.0 * t + 3.11068), dt), state=orbit)
        assert rocking.impacts == pytest.approx(seconds * 16.0 / np.pi, abs=2)
        assert rocking.steps <= samples + rocking.impacts + 2


@pytest.mark.parametrize("specimen", [Specimen(), COUPLED])
def test_a_record_beyond_all_reason_fails_and_says_so(specimen: Specimen) -> None:
    values = np.zeros(40)
    values[20:] = 1e300
    motion = simulate(specimen, SampledRecord(values, 0.01))
    assert motion.status is Status.FAILED
    assert np.isfinite(motion.end.as_array()).all()
    assert 0.18 < motion.end_time < 0.22
