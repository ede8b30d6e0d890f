"""The paper's eight statements about the coupled frame, each as a named check of what the model really does.

Steady motions are the periodic rocking orbits. Where the model does not do what the paper says, the check asserts
what it does instead, and its name and its comment say so.

Statement 8 needs recorded ground motions, which belong to their owners and are not part of the project. They are
looked for in the folder that the environment variable ROCKBENCH_RECORDS names, or else in `shared/records/campaign`
beside the project's folder; without them those checks are skipped, and synthetic motions carry the statement alone.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from sim.excitation import SampledRecord
from sim.gain import Branch, GainPrediction, gain_spectrum, predict_gain, seismic_curve
from sim.linear import bare_modes, coupled_modes
from sim.specimen import Specimen
from tests.sim.runs import A_S

SECTIONS = (0.25, 0.64, 0.97)
"""beta of the paper's sections S1, S2, S3."""


def spectrum(beta: float, low: float = 12.5, high: float = 20.0, step: float = 0.05) -> NDArray[np.float64]:
    """Columns omega, alpha_2, 1 where the orbit is stable; shape (n, 3)."""
    omegas = np.arange(low, high + 0.5 * step, step)
    predictions = gain_spectrum(Specimen(beta=beta), omegas, A_S)
    return np.array([[p.omega, rocking(p).alpha_2, rocking(p).stable] for p in predictions])


def rocking(prediction: GainPrediction) -> Branch:
    assert prediction.rocking is not None
    return prediction.rocking


def point(omega: float) -> Branch:
    """A, B and C of the paper's Fig. 4(b) lie at 16, 14 and 17.5 rad/s and beta 0.4."""
    return rocking(predict_gain(Specimen(beta=0.4), omega, A_S))


def lag_of_u1(branch: Branch) -> float:
    """Phase [degrees] of u1 ahead of theta in the fundamental of the drive, both in the paper's positive directions."""
    table = branch.orbit.samples(2000)
    wave = np.exp(-1j * table[:, 0])
    return float(np.degrees(np.angle((table[:, 1] @ wave) / (table[:, 3] @ wave))))


def test_statement_1_bare_frequencies() -> None:
    # 1.0 and 2.5 to 2.6 Hz; measured 1.006 and 2.602
    assert bare_modes(Specimen().frame).hertz == pytest.approx([1.0, 2.6], abs=0.01)


@pytest.mark.parametrize("beta", [0.1, 0.25, 0.4, 0.64, 0.97, 1.2])
def test_statement_2_least_drift_near_the_second_bare_mode(beta: float) -> None:
    # 16.35 rad/s for every beta; measured 16.00 at beta 0.1, 16.15 at 0.25, 16.20 at 0.4, 16.25 to 16.30 above
    found = spectrum(beta)
    least = found[found[:, 1].argmin(), 0]
    assert 16.0 - 1e-9 <= least <= 16.35
    assert bare_modes(Specimen().frame).omega[1] == pytest.approx(16.35, abs=0.005)


def test_statement_3_reduction_of_drift_by_eighty_percent() -> None:
    # measured least alpha_2: 0.179 at beta 0.4, 0.095 at 0.64, 0.044 at 0.97
    for beta, least in ((0.40, 0.1790), (0.64, 0.0945), (0.97, 0.0438)):
        found = spectrum(beta, 15.8, 16.8)
        best = found[found[:, 1].argmin()]
        assert best[1] == pytest.approx(least, abs=1e-4)
        assert best[1] < 0.2
        assert best[2] == 1.0


def test_statement_4_points_a_b_and_c() -> None:
    # alpha_2 0.188, 0.401, 0.770; and alpha_2 passes 1 at 17.69 rad/s, 1 % above C
    a, b, c = (point(omega).alpha_2 for omega in (16.0, 14.0, 17.5))
    assert a < b < c < 1.0
    assert (a, b, c) == pytest.approx((0.1878, 0.4009, 0.7705), abs=1e-4)
    found = spectrum(0.4, 17.5, 17.9, 0.01)
    boundary = found[(found[:, 1] > 1.0).argmax(), 0]
    assert boundary == pytest.approx(17.69, abs=0.011)


def test_statement_5_counter_phase_at_a_and_a_small_u1() -> None:
    # u1 > 0 is towards the block, theta > 0 turns the block towards the frame: equal signs are opposite motions.
    # measured: at A u1 lags theta by 19 degrees, at B by 79 (neither in phase nor in counter-phase)
    a, b, c = point(16.0), point(14.0), point(17.5)
    assert lag_of_u1(a) == pytest.approx(-19.2, abs=0.5)
    assert lag_of_u1(b) == pytest.approx(-79.0, abs=0.5)
    ratio = [branch.orbit.peaks.theta / branch.orbit.peaks.u1 for branch in (a, b, c)]
    assert ratio == pytest.approx([11.4, 140.8, 3.28], rel=0.01)


def test_finding_on_statement_5_no_motion_in_phase_at_c() -> None:
    # the paper sees u1 and theta almost in phase at C. In the model u1 lags by 27 degrees there, as in counter-phase
    # as at A; it passes 90 degrees at the resonance, 18.8 rad/s, and is in phase (140 and more) from 19.5 on
    assert lag_of_u1(point(17.5)) == pytest.approx(-27.1, abs=0.5)
    assert abs(lag_of_u1(point(20.0))) > 135.0


def test_statement_6_peaks_of_the_three_spectra() -> None:
    # beta 0.25 peaks at 17.95 rad/s (alpha_2 2.42); at 0.64 the peak, 4.20, is at 20.05, just outside the paper's range
    first, second, third = (spectrum(beta, 12.5, 21.5) for beta in SECTIONS)
    assert first[first[:, 1].argmax(), 0] == pytest.approx(18.0, abs=0.1)
    assert second[second[:, 1].argmax(), 0] == pytest.approx(20.05, abs=0.06)
    for found in (second, third):
        inside = found[found[:, 0] < 20.01, 1]
        peaks = (inside[1:-1] > inside[:-2]) & (inside[1:-1] > inside[2:])
        assert not peaks.any()
    # the smooth curve is not what a test sees where the orbit is unstable, below 15.4 rad/s
    assert 13.4 < third[third[:, 2] == 0.0, 0].min() < third[third[:, 2] == 0.0, 0].max() < 15.45


def test_statement_7_ridge_moves_up_with_the_stiffness() -> None:
    # measured 17.25, 18.25, 19.30, 20.35, 21.45 rad/s: 0.1 to 0.35 above the second mode of the linearised system
    ridge: list[float] = []
    for beta in (0.1, 0.3, 0.5, 0.7, 0.9):
        found = spectrum(beta, 16.5, 22.5)
        ridge.append(found[found[:, 1].argmax(), 0])
        assert 0.05 < ridge[-1] - coupled_modes(Specimen(beta=beta)).omega[2] < 0.4
    assert (np.diff(ridge) > 1.0).all()


def gains(acceleration: NDArray[np.float64], dt: float, cut: float | None) -> NDArray[np.float64]:
    """alpha_2 at the three sections; NaN where the block overturns.

    The record is high-passed at `cut` [Hz] (4th order, zero phase) and then scaled to a peak of 1.2 g / lambda.
    """
    if cut is not None:
        acceleration = sosfiltfilt(butter(4, cut, "high", fs=1.0 / dt, output="sos"), acceleration)
    scale = 1.2 * Specimen().uplift_acceleration / np.abs(acceleration).max()
    record = SampledRecord(scale * acceleration, dt)
    curve = seismic_curve(Specimen(), record, SECTIONS)
    return np.array([np.nan if gain.alpha_2 is None else gain.alpha_2 for gain in curve])


def synthetic(seed: int) -> NDArray[np.float64]:
    """Twenty seconds at 0.01 s: noise between 0.2 and 15 Hz under an envelope that rises, stays and dies away."""
    time = 0.01 * np.arange(2000)
    envelope = np.minimum(1.0, time / 2.0) ** 2 * np.exp(-0.35 * np.maximum(0.0, time - 8.0))
    noise = np.random.default_rng(seed).normal(size=time.size) * envelope
    return sosfiltfilt(butter(2, (0.2, 15.0), "band", fs=100.0, output="sos"), noise)


def test_finding_on_statement_8_synthetic_motions() -> None:
    # the paper finds alpha_2 < 1 for every record. Here at most 42 % of the motions have it, a few overturn the block,
    # and the median is 1.03 to 1.11; without what lies below 1.75 Hz nothing overturns and the median is lower at every
    # stiffness, 0.91 to 1.04: the band that the table reproduces is part of the statement
    whole = np.array([gains(synthetic(seed), 0.01, None) for seed in range(24)])
    passed = np.array([gains(synthetic(seed), 0.01, 1.75) for seed in range(24)])
    assert np.isnan(whole).sum() > 0
    assert not np.isnan(passed).any()
    assert ((whole < 1.0).mean(axis=0) < 0.5).all()
    assert (np.nanmedian(whole, axis=0) > 1.0).all()
    assert (np.median(passed, axis=0) < np.nanmedian(whole, axis=0)).all()
    assert np.median(passed, axis=0).min() < 0.95


def records() -> dict[str, tuple[NDArray[np.float64], float]]:
    """Acceleration and step [s] of the recorded motions that are there, by name."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "records" / "campaign"
    folder = Path(os.environ.get("ROCKBENCH_RECORDS", beside))
    return {
        name: read(folder / file)
        for name, (file, read) in {
            "Pacoima": ("RSN77_SFERN_PUL164.AT2", at2),
            "Erzincan": ("ERZIKAN_NS_EW_cms2_dt0.005.txt", lambda p: (np.loadtxt(p, comments="%")[:, 0], 0.005)),
            "El Centro": ("IELC180_oldPEER.AT2", at2),
            "L'Aquila": ("AQV_20090406_ITACA16837_H2_WE.cor.acc", lambda p: (fixed_width(p, 10, 14), 0.005)),
            "Newhall": ("RSN1044_NORTHR_NWH360.AT2", at2),
            "Kobe": ("RSN1119_KOBE_TAZ000.csv", lambda p: (np.loadtxt(p, delimiter=",")[:, 1], 0.01)),
        }.items()
        if (folder / file).is_file()
    }


def fixed_width(path: Path, header: int, width: int) -> NDArray[np.float64]:
    """Numbers in columns that may touch, after some lines of header."""
    lines = (line.rstrip() for line in path.read_text().splitlines()[header:])
    return np.array([float(line[i : i + width]) for line in lines for i in range(0, len(line), width)])


def at2(path: Path) -> tuple[NDArray[np.float64], float]:
    """A record of the PEER database: four lines of header, the last with the step, then columns of 15."""
    step = re.search(r"DT=\s*([.\d]+)", path.read_text().splitlines()[3])
    assert step is not None
    return fixed_width(path, 4, 15), float(step[1])


@pytest.mark.parametrize(
    ("name", "cut", "expected"),
    [
        ("Pacoima", None, (0.999, 1.05, 1.005)),
        ("Kobe", None, (1.05, 1.06, 1.065)),
        ("Erzincan", None, (0.995, 0.917, 0.894)),
        ("L'Aquila", None, (0.934, 0.908, 0.882)),
        ("Pacoima", 2.0, (0.670, 0.577, 0.633)),
        ("Kobe", 2.0, (1.025, 0.651, 0.852)),
        ("L'Aquila", 2.0, (0.799, 0.581, 0.613)),
    ],
)
def test_finding_on_statement_8_recorded_motions(
    name: str, cut: float | None, expected: tuple[float, float, float]
) -> None:
    """Records at their own time scale, and with the low frequencies cut that a shaker does not reproduce."""
    known = records()
    if name not in known:
        pytest.skip("no recorded motions: set ROCKBENCH_RECORDS to their folder")
    found = gains(*known[name], cut)
    assert found == pytest.approx(expected, abs=0.01)


def test_finding_on_statement_8_two_records_overturn_the_block() -> None:
    # El Centro and Newhall at their own time scale; cut below 1.5 Hz nothing overturns
    known = records()
    if not {"El Centro", "Newhall"} <= known.keys():
        pytest.skip("no recorded motions: set ROCKBENCH_RECORDS to their folder")
    for name in ("El Centro", "Newhall"):
        assert np.isnan(gains(*known[name], None)).sum() >= 2
        assert not np.isnan(gains(*known[name], 1.5)).any()
