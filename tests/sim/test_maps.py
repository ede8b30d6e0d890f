"""Gain maps against closed forms, tabulated facts, single predictions and an independent solver."""

from math import tau

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.maps import GainMap, gain_map
from sim.rocking import State, simulate
from sim.specimen import Specimen
from tests.sim.oracle import reference_motion
from tests.sim.runs import A_S

OMEGAS, BETAS = np.linspace(12.0, 21.0, 100), np.linspace(0.1, 1.2, 100)


@pytest.fixture(scope="module")
def full() -> GainMap:
    return gain_map(Specimen(), BETAS, OMEGAS, A_S)


def test_the_rocking_orbit_exists_everywhere(full: GainMap) -> None:
    assert full.rocking.exists.all()
    assert ((full.rocking.peaks[:, :, 2] > 0.02) & (full.rocking.peaks[:, :, 2] < 0.07)).all()


def test_multipliers_keep_their_product(full: GainMap) -> None:
    # r^4 exp(-((c1 + c2)/m1 + c2/m2) T): volume left after a period with two impacts (Liouville)
    frame, (c1, c2) = full.specimen.frame, full.specimen.frame.dashpots
    rate = (c1 + c2) / frame.m1 + c2 / frame.m2
    closed_form = full.specimen.block.restitution**4 * np.exp(-rate * tau / OMEGAS)
    product = full.rocking.multipliers.prod(axis=2)
    assert np.abs(product.real / closed_form - 1.0).max() < 1e-8


def test_resting_branch_has_its_known_extent(full: GainMap) -> None:
    # counted by another program from the closed form, on this grid
    assert full.resting.exists.sum() == 1441
    assert full.resting.stable.sum() == 1441


def test_rocking_branch_is_stable_where_it_should_be(full: GainMap) -> None:
    # of 10 000 cells 2553 - 2182 = 371 overturned and 10 000 - 2553 - 6726 = 721 survived on an unstable orbit
    assert (~full.rocking.stable).sum() == 371 + 721
    assert full.rocking.stable[np.ix_(BETAS <= 0.5, OMEGAS >= 12.5)].all()


@pytest.mark.parametrize(("i", "j"), [(0, 0), (99, 99), (50, 13), (17, 65), (80, 30)])
def test_a_cell_is_the_single_prediction(full: GainMap, i: int, j: int) -> None:
    prediction = predict_gain(Specimen(beta=float(BETAS[i])), float(OMEGAS[j]), A_S)
    for name, branch in (("rocking", full.rocking), ("resting", full.resting)):
        if name not in prediction.branches:
            assert np.isnan(branch.alpha_2[i, j])
            continue
        single = prediction.branches[name]
        assert branch.alpha_1[i, j] == pytest.approx(single.alpha_1, rel=1e-9)
        assert branch.alpha_2[i, j] == pytest.approx(single.alpha_2, rel=1e-9)
        assert branch.multiplier[i, j] == pytest.approx(single.multiplier, rel=1e-8)
        assert branch.stable[i, j] == single.stable


@pytest.mark.parametrize(("i", "j"), [(5, 50), (60, 20), (95, 90)])
def test_peaks_are_those_of_an_independent_solver(full: GainMap, i: int, j: int) -> None:
    specimen, omega, section = Specimen(beta=float(BETAS[i])), float(OMEGAS[j]), full.sections[i, j]
    period, start = tau / omega, np.array([*section[1:5], 0.0, section[5]])
    drive = SineProgram([Sweep.dwell(2.0 * period, A_S, omega)], float(section[0]))
    times = np.linspace(0.0, period, 2001)
    samples = simulate(specimen, drive, state=State.from_array(start), sample_times=times).samples
    assert samples is not None
    for column, bottom in ((0, None), (1, 0)):
        values = samples[:, column] - (0.0 if bottom is None else samples[:, bottom])
        place = int(np.abs(values[1:-1]).argmax()) + 1
        found: list[float] = []
        for t in times[place - 1 : place + 2]:
            end, _ = reference_motion(
                specimen, lambda s: A_S * float(np.sin(section[0] + omega * s)), [0.0, float(t)], start, 1
            )
            found.append(float(end[column] - (0.0 if bottom is None else end[bottom])))
        before, middle, after = found
        # the vertex of the parabola: its error is of fourth order in a thousandth of the period
        vertex = middle - (after - before) ** 2 / (8.0 * (after - 2.0 * middle + before))
        assert abs(vertex) == pytest.approx(full.rocking.peaks[i, j, column], rel=1e-9)


@pytest.mark.parametrize(
    ("beta", "windows"),
    [
        (0.5, []),
        (0.7, [(12.60, 13.325), (13.625, 14.15)]),
        (0.8, [(12.925, 13.675), (13.875, 14.65)]),
        (0.97, [(13.425, 14.225), (14.35, 15.425)]),
        (1.2, [(14.075, 14.875), (15.0, 16.425)]),
        (1.5, [(14.85, 15.65), (15.875, 17.625)]),
    ],
)
def test_windows_of_instability(beta: float, windows: list[tuple[float, float]]) -> None:
    # known as the first grid points of each new state, on steps of 0.025 rad/s from 12.5
    omegas = np.arange(12.5, 18.01, 0.025)
    stable = gain_map(Specimen(), [beta], omegas, A_S).rocking.stable[0]
    changes = omegas[1:][stable[1:] != stable[:-1]]
    assert changes == pytest.approx(np.array(windows).ravel(), abs=1e-9)


def test_a_coarse_map_lies_on_the_same_orbits(full: GainMap) -> None:
    for step in (33, 99):
        coarse = gain_map(Specimen(), BETAS[::step], OMEGAS[::step], A_S)
        assert coarse.rocking.peaks == pytest.approx(full.rocking.peaks[::step, ::step], rel=1e-9)


def test_axes_in_any_order_and_another_bare_test(full: GainMap) -> None:
    rows, columns = [70, 3, 70], [99, 0, 40]
    some = gain_map(Specimen(), BETAS[rows], OMEGAS[columns], A_S, bare_amplitude=2.0 * A_S)
    assert some.betas.tolist() == BETAS[rows].tolist()
    assert 2.0 * some.rocking.alpha_2 == pytest.approx(full.rocking.alpha_2[np.ix_(rows, columns)], rel=1e-9)
    assert 2.0 * some.resting.alpha_1 == pytest.approx(full.resting.alpha_1[np.ix_(rows, columns)], nan_ok=True)


def test_too_weak_a_drive_has_only_the_resting_branch() -> None:
    # a hundredth of the amplitude cannot make up for what two impacts take from any motion of this period
    weak = gain_map(Specimen(), [0.2, 0.4], [15.0, 16.0], 0.01 * A_S)
    assert not weak.rocking.exists.any()
    assert not weak.rocking.stable.any()
    assert np.isnan(weak.rocking.multiplier).all()
    assert weak.resting.exists.all()


def test_holes_are_gone_round() -> None:
    # at low frequency there is no such orbit; the map goes on elsewhere
    holed = gain_map(Specimen(), [0.1, 0.6, 1.2], np.linspace(3.0, 21.0, 10), 0.9 * A_S)
    exists = holed.rocking.exists
    assert exists[:, -3:].all()
    assert not exists.all()
    for i, j in np.argwhere(exists):
        frame, (c1, c2) = holed.specimen.frame, holed.specimen.frame.dashpots
        rate = (c1 + c2) / frame.m1 + c2 / frame.m2
        closed_form = holed.specimen.block.restitution**4 * np.exp(-rate * tau / holed.omegas[j])
        assert holed.rocking.multipliers[i, j].prod().real == pytest.approx(closed_form, rel=1e-5)


@pytest.mark.parametrize(
    ("betas", "omegas", "amplitude", "item"),
    [
        ([], [16.0], A_S, "grid"),
        ([0.4], [0.0], A_S, "omega"),
        ([0.4], [16.0], -1.0, "amplitude"),
        ([-0.1], [16.0], A_S, "beta"),
    ],
)
def test_bad_input_is_refused(betas: list[float], omegas: list[float], amplitude: float, item: str) -> None:
    with pytest.raises(ValueError, match=item):
        gain_map(Specimen(), betas, omegas, amplitude)
    with pytest.raises(InvalidInput, match="omega"):
        gain_map(Specimen(), [0.4], [float("nan")], A_S)
