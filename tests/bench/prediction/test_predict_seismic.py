"""`rockbench predict seismic` and `band-study`, against other ways to integrate and what the records are known for."""

import csv
import json
from itertools import pairwise
from math import floor, log10
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lsim, lti, sosfiltfilt

from bench.accelerograms.synthetic import NAMES
from bench.app.cli.main import main
from bench.comparators.catalogue import solve
from bench.control.preparation import prepare
from bench.figures.seismic_figure import GainCurve, seismic_figure
from bench.prediction.requests import SeismicRequest
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.specimen import Specimen
from tests.bench.accelerograms.real import CAMPAIGN, needed
from tests.sim.oracle import reference_motion

PEAK = 1.2 * 9.81 / 8.0
BAND = (2.0, 20.0)


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def shaken(tmp_path: Path) -> SampledRecord:
    """Three seconds of noise, also in the file `shaken.csv`."""
    rough = np.convolve(np.random.default_rng(3).standard_normal(151), np.hanning(7), "same")
    values = rough * np.hanning(151)
    rows = "".join(f"{0.02 * k:.2f},{value!r}\n" for k, value in enumerate(values.tolist()))
    (tmp_path / "shaken.csv").write_text(f"t [s],a [m/s2]\n{rows}", encoding="utf-8")
    return SampledRecord(values, 0.02)


def predicted(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["predict", *arguments, "--json"]) == 0
    shown = capsys.readouterr()
    assert shown.out.count("\n") == 1
    return json.loads(shown.out)


def bare_drift(values: NDArray[np.float64], dt: float) -> float:
    """Greatest drift [m] of the frame alone, its matrices typed from the paper, by scipy at a fortieth of the step."""
    frame, (c1, c2) = Specimen().frame, Specimen().frame.dashpots
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2, :2], a[2, 2:] = (
        [-(frame.k1 + frame.k2) / frame.m1, frame.k2 / frame.m1],
        [-(c1 + c2) / frame.m1, c2 / frame.m1],
    )
    a[3, :2], a[3, 2:] = [frame.k2 / frame.m2, -frame.k2 / frame.m2], [c2 / frame.m2, -c2 / frame.m2]
    system = lti(a, np.array([[0.0], [0.0], [-1.0], [-1.0]]), np.array([[-1.0, 1.0, 0.0, 0.0]]), np.zeros((1, 1)))
    fine = np.arange(40 * (values.size - 1) + 1) / 40.0
    drift = lsim(system, np.interp(fine, np.arange(values.size), values), fine * dt)[1]
    return float(np.abs(drift).max())


def test_gains_within_a_band_agree_with_other_integrators(
    capsys: pytest.CaptureFixture[str], shaken: SampledRecord
) -> None:
    answer = predicted(capsys, "seismic", "shaken.csv", "--table-band", "2:20", "--beta", "0.5", "0.9", "--trim", "0")
    assert answer["table_band"] == "2 to 20 Hz"
    # the pipeline, done by hand: rest of four periods of the lower end, scipy's filters, then the scale
    n, rest = shaken.acceleration.size, round(4.0 / BAND[0] / shaken.dt)
    (motion,) = answer["motions"]
    prepared = prepare(shaken, band=BAND, peak=PEAK, trim=None)
    made = prepared.record
    padded = np.zeros(made.acceleration.size)
    padded[rest : rest + n] = shaken.acceleration
    high = sosfiltfilt(butter(4, BAND[0], "highpass", fs=50.0, output="sos"), padded)
    frequency = np.fft.rfftfreq(padded.size, 0.02)
    whole = np.fft.irfft(np.fft.rfft(high) / (1.0 + (frequency / BAND[1]) ** 8), padded.size)
    assert made.acceleration == pytest.approx(whole * PEAK / np.abs(whole).max(), abs=0.02 * PEAK)
    assert motion["peak_m_s2"] == pytest.approx(PEAK, rel=1e-8)
    assert motion["begin_s"] == -rest * shaken.dt
    assert motion["displacement_max_m"] == pytest.approx(prepared.motion.peak_displacement, rel=1e-8)
    bare = bare_drift(made.acceleration, made.dt)
    for gain in answer["gains"]:
        specimen = Specimen(beta=gain["beta"])
        assert (gain["status"], gain["toppled"], gain["toppled_time_s"]) == ("completed", False, None)
        assert gain["impacts"] > 3
        assert gain["bare_drift_max_m"] == pytest.approx(bare, rel=1e-5)
        other = solve("dop853", specimen, made, tolerance=1e-12)
        assert gain["drift_max_m"] == pytest.approx(other.peaks.drift, rel=1e-7)
        assert gain["alpha_2"] == pytest.approx(other.peaks.drift / bare, rel=1e-5)
        # and by equations that share nothing with those above
    times = (np.arange(made.acceleration.size) * made.dt).tolist()
    end, _ = reference_motion(specimen, lambda t: float(np.interp(t, times, made.acceleration)), times, np.zeros(6), 0)
    assert simulate(specimen, made).end.as_array() == pytest.approx(end, abs=1e-8)


def test_records_as_they_are_give_the_gains_that_are_known_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    """Another integrator and another reader found these; El Centro and Newhall overturn the block."""
    files = {
        "pacoima": f"{needed(CAMPAIGN / 'RSN77_SFERN_PUL164.AT2')}@name=pacoima",
        "newhall": f"{needed(CAMPAIGN / 'RSN1044_NORTHR_NWH360.AT2')}@name=newhall",
        "kobe": f"{needed(CAMPAIGN / 'RSN1119_KOBE_TAZ000.csv')}@unit=g,name=kobe",
    }
    sections = ("--beta", "0.25", "0.64", "0.97", "--trim", "0")
    answer = predicted(capsys, "seismic", *files.values(), "--table-band", "none", *sections)
    found = {name: [gain["alpha_2"] for gain in answer["gains"] if gain["record"] == name] for name in files}
    assert found["pacoima"] == pytest.approx([0.999, 1.05, 1.005], abs=0.002)
    assert found["kobe"] == pytest.approx([1.05, 1.055, 1.065], abs=0.005)
    assert found["newhall"].count(None) >= 2
    # above 1.5 Hz nothing overturns, and the drift falls
    answer = predicted(capsys, "seismic", *files.values(), "--table-band", "1.5:100", *sections)
    assert not any(gain["toppled"] for gain in answer["gains"])
    assert max(gain["alpha_2"] for gain in answer["gains"] if gain["record"] != "newhall") < 0.9


def test_a_block_that_topples_has_a_time_and_no_gain(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ("--peak-factor", "6", "--beta", "0.1:1:4", "--csv", "gains.csv", "--out", "gains.h5")
    answer = predicted(capsys, "seismic", "synthetic:newhall", "--table-band", "none", *flags)
    gains = answer["gains"]
    toppled = [gain for gain in gains if gain["toppled"]]
    assert toppled
    for gain in toppled:
        assert gain["status"].startswith("overturned about ")
        assert gain["alpha_1"] is gain["alpha_2"] is gain["drift_max_m"] is None
        assert 0.0 < gain["toppled_time_s"] < answer["motions"][0]["duration_s"]
        assert 0.0 < gain["toppled_time_error_s"] < 1e-6
        assert gain["toppled_time_s"] == round(gain["toppled_time_s"], floor(-log10(gain["toppled_time_error_s"])))
    assert (gains[0]["band_low_hz"], gains[0]["band_high_hz"]) == (None, None)
    assert answer["table_band"].startswith("none")
    with Path("gains.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["alpha_2"] == "" for row in rows] == [gain["toppled"] for gain in gains]
    assert {row["record"] for row in rows} == {"synthetic newhall"}
    with h5py.File("gains.h5") as stored:
        assert stored["entry/gains/toppled"][:].tolist() == [gain["toppled"] for gain in gains]
        assert json.loads(stored["entry/metadata/table_band"][()]) == answer["table_band"]
        assert json.loads(stored["entry/metadata/request"][()]) == answer["request"]
        for table in (stored["entry/gains"], stored["entry/motions"]):
            for name, column in table.items():
                unit = column.attrs.get("units", "1")
                suffix = {"m/s2": "m_s2", "m/s": "m_per_s", "Hz": "hz"}.get(unit, unit)
                assert unit == "1" or name.endswith(f"_{suffix}")


def test_without_records_the_seven_synthetic_ones_are_taken_and_named_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "bench.toml").write_text("[simulation.bench.shaker]\nband_low = 1.5\n", encoding="utf-8")
    flags = ("--config", "bench.toml", "--beta", "0.5", "--plot", "figure.png")
    assert main(["predict", "seismic", *flags]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("table's band: 1.5 to 100 Hz; records scaled to 1.472 m/s2")
    assert all(f"synthetic {name} " in shown for name in NAMES)
    assert Path("figure.png").read_bytes().startswith(b"\x89PNG")
    hardware = 'backend = "hardware"\n[hardware]\nband_low = 2.0\nband_high = 50.0\n'
    (tmp_path / "laboratory.toml").write_text(hardware, encoding="utf-8")
    answer = predicted(capsys, "seismic", "synthetic:kobe", "--config", "laboratory.toml", "--beta", "0.5")
    assert answer["table_band"] == "2 to 50 Hz"
    assert [gain["synthetic"] for gain in answer["gains"]] == [True]


def test_the_stroke_is_fitted_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    options = ("synthetic:erzincan", "--table-band", "none", "--beta", "0.5", "--peak-factor", "2")
    free = predicted(capsys, "seismic", *options)["motions"][0]
    fitted = predicted(capsys, "seismic", *options, "--stroke-fit", "high-pass")["motions"][0]
    assert free["displacement_max_m"] > 0.054 >= fitted["displacement_max_m"]
    assert "high-pass at" in fitted["steps"]


def test_the_study_scales_at_every_corner_and_agrees_with_single_predictions(
    capsys: pytest.CaptureFixture[str],
) -> None:
    flags = ("--corner", "0.5:2.5:5", "--beta", "0.25", "0.97", "--plot", "study.svg")
    answer = predicted(capsys, "band-study", "synthetic:pacoima", "synthetic:newhall", *flags)
    assert [motion["band_low_hz"] for motion in answer["motions"]] == [0.5, 1.0, 1.5, 2.0, 2.5] * 2
    assert [motion["peak_m_s2"] for motion in answer["motions"]] == pytest.approx([PEAK] * 10, rel=1e-8)
    factors = [motion["factor"] for motion in answer["motions"][:5]]
    assert all(a != b for a, b in pairwise(factors))
    assert len(answer["gains"]) == 20
    alone = predicted(capsys, "seismic", "synthetic:newhall", "--table-band", "1.5:100", "--beta", "0.25", "0.97")[
        "gains"
    ]
    same = [gain for gain in answer["gains"] if (gain["record"], gain["band_low_hz"]) == ("synthetic newhall", 1.5)]
    assert same == alone
    assert "<svg" in Path("study.svg").read_text(encoding="utf-8")


def test_the_figure_breaks_the_curve_where_the_block_topples() -> None:
    beta = np.linspace(0.1, 1.0, 4)
    gains = np.array([0.9, np.nan, 1.1, np.nan])
    curve = GainCurve("one", beta, gains, gains, np.isnan(gains))
    figure = seismic_figure([curve], "1 to 100 Hz")
    upper, _, fallen = figure.axes
    assert upper.get_title(loc="right") == "table's band: 1 to 100 Hz"
    assert np.array_equal(upper.lines[0].get_ydata(), gains, equal_nan=True)
    assert fallen.lines[0].get_xdata().tolist() == beta[[1, 3]].tolist()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("seismic absent.AT2", "absent.AT2"),
        ("seismic synthetic:tohoku", "the synthetic motions are pacoima"),
        (
            "seismic synthetic:kobe synthetic:kobe:2",
            "its name, synthetic kobe, is already used by synthetic:kobe; omit one",
        ),
        ("seismic --table-band 5:1", "--table-band = '5:1' is refused: it must be LOW:HIGH"),
        ("seismic --table-band wide", "--table-band = 'wide' is refused"),
        ("seismic --table-band 90:95", "its lower end must be below 50 Hz, half the sample rate"),
        ("seismic --peak-factor 0", "--peak-factor = 0.0 is refused"),
        ("seismic --trim 0.5", "--trim = 0.5 is refused"),
        ("seismic --length-ratio 2", "--length-ratio = 2.0 is refused"),
        ("seismic --beta 0.2 0.2", "each value may occur only once"),
        ("seismic --stroke-fit tight", "--stroke-fit = 'tight' is refused"),
        ("seismic --config absent.toml", "there is no such file"),
        ("seismic --plot figure.jpg", "its name must end with .png"),
        ("band-study --table-band none", "the study varies the band's lower end"),
        ("band-study --table-band 1:2", "--corner = 3.0 is refused: it must be below the band's upper end, 2 Hz"),
        ("band-study --corner 1", "--corner = [1.0] is refused: it must be two or more numbers"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys: pytest.CaptureFixture[str], arguments: str, said: str) -> None:
    assert main(["predict", *arguments.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert said in shown.err
    assert not list(Path().iterdir())


def test_the_papers_peak_and_stiffnesses_are_the_default() -> None:
    request = SeismicRequest()
    assert (request.peak_factor, len(request.beta), request.beta[0], request.beta[-1]) == (1.2, 40, 0.05, 1.2)
