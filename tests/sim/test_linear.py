"""Modes and steady response against the values of the paper's matrices and against the equations of motion."""

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.linear import bare_modes, bare_peaks, coupled_modes, frame_matrices, steady_peaks, steady_response
from sim.rocking import State, simulate
from sim.specimen import Frame, Specimen
from tests.sim.oracle import printed_rates
from tests.sim.runs import A_S


def test_bare_modes() -> None:
    modes = bare_modes(Frame())
    assert modes.omega == pytest.approx([6.321568, 16.350104], abs=1e-6)
    assert modes.hertz[0] == pytest.approx(1.0, abs=0.01)
    assert not modes.divergent.any()
    # the storeys move together, then against each other (Fig. 3)
    assert modes.shapes[0] == pytest.approx([1.0, 1.0])
    assert modes.shapes[1, 0] > 0.0 > modes.shapes[1, 1]


@pytest.mark.parametrize(
    ("beta", "omega"),
    [
        (0.25, (-5.434, 6.526, 17.785)),
        (0.40, (-5.151, 6.627, 18.626)),
        (0.64, (-4.777, 6.762, 19.934)),
        (0.97, (-4.381, 6.906, 21.650)),
    ],
)
def test_coupled_modes_are_those_of_equations_12_to_14(beta: float, omega: tuple[float, ...]) -> None:
    assert coupled_modes(Specimen(beta=beta)).omega == pytest.approx(omega, abs=5.1e-4)


@pytest.mark.parametrize("corner", [1, -1])
def test_coupled_modes_are_those_of_the_printed_equations(corner: int) -> None:
    specimen = Specimen(beta=0.64)
    step, jacobian = 1e-6, np.zeros((3, 3))
    for column, place in enumerate((0, 1, 4)):
        ahead, behind = np.zeros(6), np.zeros(6)
        ahead[place], behind[place] = step, -step
        change = printed_rates(specimen, corner, ahead, 0.0) - printed_rates(specimen, corner, behind, 0.0)
        jacobian[:, column] = change[[2, 3, 5]] / (2.0 * step)
    modes = coupled_modes(specimen)
    values = np.sign(modes.omega) * modes.omega**2
    assert np.sort(np.linalg.eigvals(-jacobian).real) == pytest.approx(values, rel=1e-6)
    assert -jacobian @ modes.shapes == pytest.approx(modes.shapes * values, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("beta", [0.1, 0.97, 1.5, 100.0])
def test_first_coupled_mode_of_the_papers_frame_diverges_at_every_stiffness(beta: float) -> None:
    assert coupled_modes(Specimen(beta=beta)).divergent.tolist() == [True, False, False]


def test_divergence_ends_where_spring_and_frame_in_series_outweigh_gravity() -> None:
    frame, weight = Frame(k1=1000.0), Specimen().block.h_b * Specimen().block.mass * 9.81
    needed = weight / frame.h1**2
    beta = needed / (frame.k1 - needed)
    assert coupled_modes(Specimen(frame=frame, beta=beta * 0.999)).divergent[0]
    assert not coupled_modes(Specimen(frame=frame, beta=beta * 1.001)).divergent[0]


@pytest.mark.parametrize(("specimen", "resting"), [(Specimen(), False), (Specimen(beta=0.25), True)])
def test_a_run_stays_on_the_steady_response(specimen: Specimen, resting: bool) -> None:
    omega = 18.5
    u1, u2 = steady_response(specimen, omega, A_S, resting=resting)
    start = State(u1.imag, u2.imag, omega * u1.real, omega * u2.real)
    periods = 20 * 2.0 * np.pi / omega
    motion = simulate(specimen, SineProgram([Sweep.dwell(periods, A_S, omega)]), state=start)
    assert motion.end.as_array() == pytest.approx(start.as_array(), abs=1e-11)
    peaks = steady_peaks(specimen, omega, A_S, resting=resting)
    assert (motion.peaks.u1, motion.peaks.drift) == pytest.approx((peaks.u1, peaks.drift), rel=1e-9)


def test_static_limit_is_the_static_deflection() -> None:
    frame = Frame()
    u1, u2 = steady_response(Specimen(), 1e-5, 1.0)
    assert u1.real == pytest.approx(-(frame.m1 + frame.m2) / frame.k1, rel=1e-6)
    assert (u2 - u1).real == pytest.approx(-frame.m2 / frame.k2, rel=1e-6)


def test_damping_matrix_is_symmetric_and_dissipates() -> None:
    _, damping, _ = frame_matrices(Frame())
    assert damping[0, 1] == damping[1, 0]
    assert (np.linalg.eigvalsh(damping) > 0.0).all()


@pytest.mark.parametrize("omega", [0.0, -1.0, float("nan"), float("inf")])
def test_frequency_must_be_positive(omega: float) -> None:
    with pytest.raises(InvalidInput, match="omega"):
        steady_response(Specimen(), omega, 1.0)


def test_amplitude_must_be_finite() -> None:
    with pytest.raises(InvalidInput, match="amplitude"):
        steady_peaks(Specimen(), 10.0, float("nan"))


def test_peaks_of_many_frames_are_those_of_each() -> None:
    random = np.random.default_rng(1)
    frames = [Frame(k1=k1) for k1 in random.uniform(80.0, 300.0, 30).tolist()]
    omega, amplitude = random.uniform(1.0, 40.0, 30), random.uniform(0.1, 5.0, 30)
    cases = zip(frames, omega.tolist(), amplitude.tolist(), strict=True)
    each = [steady_peaks(Specimen(frame=frame), *motion) for frame, *motion in cases]
    found = bare_peaks(frames, omega, amplitude)
    assert found == pytest.approx(np.array([(peaks.u1, peaks.drift) for peaks in each]), rel=1e-14)
