"""What `rockbench predict` prints and writes, against values that others computed."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bench.app.cli.inputs import specimen_from
from bench.app.cli.main import main
from bench.config.validation import read_fields
from bench.datafile import tables
from bench.datafile.hdf5 import group, open_to_read
from bench.prediction.history import QUANTITIES
from bench.prediction.requests import HistoryRequest, MapRequest, SineRequest
from bench.prediction.steady import rounded
from sim.excitation import SineProgram, Sweep
from sim.rocking import simulate
from sim.specimen import Specimen

STEADY_ALPHA_2 = [
    (0.40, 16.05, 0.18429),
    (0.40, 13.95, 0.40493),
    (0.40, 17.55, 0.82627),
    (0.25, 17.85, 2.37277),
    (0.64, 19.95, 4.12652),
    (0.97, 19.95, 0.78063),
]
"""Steady alpha_2 on the rocking orbit, cross-checked with three integrators, to the digits given."""

MODES = {
    0.25: (-5.434, 6.526, 17.785),
    0.40: (-5.151, 6.627, 18.626),
    0.64: (-4.777, 6.762, 19.934),
    0.97: (-4.381, 6.906, 21.650),
}
"""sign(lambda) sqrt|lambda| of M^-1 K [rad/s] of the linearised coupled system, to the digits given."""


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def predict(*arguments: str) -> int:
    return main(["predict", *arguments])


def predicted(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert predict(*arguments, "--json") == 0
    shown = capsys.readouterr()
    assert shown.out.count("\n") == 1
    return json.loads(shown.out)


def test_steady_gains_agree_with_the_reference_to_its_digits(capsys: pytest.CaptureFixture[str]) -> None:
    for beta, omega, alpha_2 in STEADY_ALPHA_2:
        points = predicted(capsys, "steady", "--omega", str(omega), "--beta", str(beta))["points"]
        (point,) = [point for point in points if point["layer"] == "rocking"]
        assert (point["omega_rad_s"], point["beta"]) == (omega, beta)
        assert round(point["alpha_2"], 5) == alpha_2
        assert point["impacts_per_period"] == 2
        assert 0.025 < point["theta_max_rad"] < 0.06
        assert 0.9 < point["floquet_modulus"] < 1.0
        assert point["stable"] is True


def test_each_existing_branch_is_an_entry_and_the_resting_one_agrees_with_its_closed_form(
    capsys: pytest.CaptureFixture[str],
) -> None:
    points = predicted(capsys, "steady", "--omega", "17.5", "18", "--beta", "0.25")["points"]
    assert [(point["omega_rad_s"], point["layer"]) for point in points] == [
        (17.5, "rocking"),
        (18.0, "rocking"),
        (18.0, "resting"),
    ]
    rocking, resting = points[1:]
    assert round(resting["alpha_2"], 3) == 3.365
    assert round(rocking["alpha_2"], 1) == 2.4
    assert (resting["theta_max_rad"], resting["impacts_per_period"], resting["stable"]) == (0.0, 0, True)


def test_an_unstable_orbit_is_said_to_be_one_and_by_which_bifurcation(capsys: pytest.CaptureFixture[str]) -> None:
    points = predicted(capsys, "steady", "--omega", "13.0", "14.0", "--beta", "0.64")["points"]
    assert [point["stable"] for point in points] == [False, True]
    assert points[0]["floquet_modulus"] > 1.0
    # Neimark-Sacker: a conjugate pair leaves the unit circle at 150 to 170 degrees
    assert 150.0 < np.degrees(points[0]["floquet_argument_rad"]) < 170.0


def test_json_says_what_it_was_computed_from_and_holds_no_noise(capsys: pytest.CaptureFixture[str]) -> None:
    answer = predicted(capsys, "steady", "--omega", "16", "--beta", "0.4", "--distance", "0.2")
    assert answer["specimen"]["d"] == 0.2
    assert answer["request"]["omega"] == [16.0]
    assert answer["software"]["rocking-bench"].startswith("0.")
    digits = f"{answer['points'][0]['alpha_2']!r}".removeprefix("0.").lstrip("0")
    assert 8 <= len(digits) <= 11


def test_amplitude_distance_and_restitution_reach_the_model(capsys: pytest.CaptureFixture[str]) -> None:
    def gain(*options: str) -> dict[str, Any]:
        return predicted(capsys, "steady", "--omega", "16.05", "--beta", "0.4", *options)["points"][0]

    paper = gain()
    assert paper["amplitude_m_s2"] == pytest.approx(1.238512, abs=1e-6)
    assert gain("--amplitude-factor", "1.1")["amplitude_m_s2"] == pytest.approx(1.1 * 9.81 / 8.0, rel=1e-12)
    distant = gain("--distance", "0.5")["alpha_2"]
    assert 0.0 < abs(distant / paper["alpha_2"] - 1.0) < 0.015
    assert gain("--restitution-factor", "0.992")["floquet_modulus"] < paper["floquet_modulus"]


def test_the_specimen_of_a_file_is_used_and_flags_win_over_it(capsys: pytest.CaptureFixture[str]) -> None:
    Path("specimen.toml").write_text("beta = 0.64\nd = 0.3\n[frame]\nk1 = 250.0\n", encoding="utf-8")
    answer = predicted(capsys, "steady", "--specimen", "specimen.toml", "--omega", "16")
    assert answer["specimen"]["frame"]["k1"] == 250.0
    assert (answer["specimen"]["d"], answer["points"][0]["beta"]) == (0.3, 0.64)
    answer = predicted(
        capsys, "steady", "--specimen", "specimen.toml", "--omega", "16", "--beta", "0.4", "--distance", "0.1"
    )
    assert (answer["specimen"]["d"], answer["points"][0]["beta"]) == (0.1, 0.4)
    assert specimen_from(None, None, "0.992").block.restitution_factor == 0.992


def test_modes_agree_with_the_reference_and_the_first_one_is_divergent(capsys: pytest.CaptureFixture[str]) -> None:
    modes = predicted(capsys, "modes", "--beta", *map(str, MODES))["modes"]
    bare = [mode for mode in modes if mode["system"] == "bare"]
    assert [round(mode["omega_rad_s"], 6) for mode in bare] == [6.321568, 16.350104]
    assert [mode["beta"] for mode in bare] == [None, None]
    for beta, reference in MODES.items():
        coupled = [mode for mode in modes if mode["beta"] == beta]
        assert tuple(round(mode["signed_root_rad_s"], 3) for mode in coupled) == reference
        assert [mode["divergent"] for mode in coupled] == [True, False, False]
        assert coupled[0]["frequency_hz"] is None
        assert round(coupled[0]["growth_rate_per_s"], 3) == -reference[0]
        assert round(2.0 * np.pi * coupled[2]["frequency_hz"], 3) == reference[2]


def test_a_history_from_rest_ends_when_the_block_overturns(capsys: pytest.CaptureFixture[str]) -> None:
    (history,) = predicted(capsys, "history", "--omega", "16", "--duration", "5")["histories"]
    assert history["status"].startswith("overturned")
    assert 0.0 < history["end_time_s"] < 5.0
    time, theta, bare = (history[name] for name in ("time_s", "theta_rad", "bare_drift_m"))
    assert len(time) == len(theta) == len(bare) == int(5.0 * 16.0 / (2.0 * np.pi) * 200) + 1
    present = [value is not None for value in theta]
    assert present == [t <= history["end_time_s"] for t in time]
    assert all(value is not None for value in bare)
    # at rest until the base first exceeds what holds the block, g / lambda, less the spring's help
    assert theta[0] == 0.0
    assert history["base_acceleration_m_s2"][50] == pytest.approx(1.01 * 9.81 / 8.0, rel=1e-3)


def test_a_steady_history_repeats_and_has_the_peaks_of_the_orbit(capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--omega", "18.5", "--beta", "0.25")
    points = predicted(capsys, "steady", *options)["points"]
    histories = predicted(capsys, "history", *options, "--steady", "--periods", "2")["histories"]
    assert (
        [history["motion"] for history in histories] == [point["layer"] for point in points] == ["rocking", "resting"]
    )
    for history, point in zip(histories, points, strict=True):
        for name in ("u1_m", "drift_m", "theta_rad", "bare_drift_m"):
            values = np.array(history[name])
            np.testing.assert_allclose(values[:201], values[200:], atol=1e-15)
            peak = point[f"{name.removesuffix('_m').removesuffix('_rad')}_max_{name.rpartition('_')[2]}"]
            # 200 samples in a period miss a peak by at most half a step of phase
            assert peak * np.cos(np.pi / 100) <= np.abs(values).max() <= peak * (1.0 + 1e-9)


def test_a_spectrum_has_its_least_gain_near_the_second_mode_of_the_bare_frame(
    capsys: pytest.CaptureFixture[str],
) -> None:
    points = predicted(capsys, "spectrum", "--omega", "15.5:17:31", "--beta", "0.25", "0.97")["points"]
    for beta in (0.25, 0.97):
        rows = [point for point in points if (point["beta"], point["layer"]) == (beta, "rocking")]
        assert [row["omega_rad_s"] for row in rows] == [float(f"{15.5 + 0.05 * k:.2f}") for k in range(31)]
        assert min(rows, key=lambda row: row["alpha_2"])["omega_rad_s"] == pytest.approx(16.35, abs=0.25)


def test_map_spectrum_and_steady_agree_and_the_map_is_in_order(capsys: pytest.CaptureFixture[str]) -> None:
    axes = ("--omega", "20", "17.55", "13.95", "--beta", "0.4", "0.25")
    points = predicted(capsys, "map", *axes, "--band")["points"]
    places = [(point["beta"], point["omega_rad_s"]) for point in points]
    assert list(dict.fromkeys(places)) == [(beta, omega) for beta in (0.25, 0.4) for omega in (13.95, 17.55, 20.0)]
    for command in ("steady", "spectrum"):
        others = predicted(capsys, command, *axes)["points"]
        assert len(others) == len(points)
        named = {(point["beta"], point["omega_rad_s"], point["layer"]): point for point in others}
        for point in points:
            other = named[point["beta"], point["omega_rad_s"], point["layer"]]
            assert point.keys() == other.keys()
            for name, value in point.items():
                # multipliers of maps come from a coarser difference than those of single points
                tolerance = 3e-9 if name.startswith("floquet") else 3e-10
                assert value == (pytest.approx(other[name], rel=tolerance) if isinstance(value, float) else other[name])


def test_another_solver_comes_to_its_own_gain_and_says_how_its_run_ended(capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--omega", "17.5", "--beta", "0.4")
    (exact,) = predicted(capsys, "steady", *options)["points"]
    assert "status" not in exact
    (coarse,) = predicted(capsys, "steady", *options, "--solver", "paper")["points"]
    assert coarse["status"] == "completed"
    # the paper's scheme, rebuilt literally, is off by 4 % there
    assert 0.02 < abs(coarse["alpha_2"] / exact["alpha_2"] - 1.0) < 0.06
    (located,) = predicted(capsys, "steady", *options, "--solver", "rk4-located")["points"]
    assert located["alpha_2"] == pytest.approx(exact["alpha_2"], rel=1e-3)


def test_csv_reads_back_with_units_in_the_names_and_every_digit(capsys: pytest.CaptureFixture[str]) -> None:
    points = predicted(capsys, "steady", "--omega", "17.5", "20", "--beta", "0.25", "--csv", "points.csv")["points"]
    with Path("points.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(points) == 3
    assert list(rows[0]) == list(points[0])
    for row, point in zip(rows, points, strict=True):
        for name, value in point.items():
            if isinstance(value, bool):
                assert row[name] == ("true" if value else "false")
            elif isinstance(value, str):
                assert row[name] == value
            else:
                assert float(row[name]) == value
    # an absent value is an empty cell
    assert predict("modes", "--beta", "0.4", "--csv", "modes.csv") == 0
    assert Path("modes.csv").read_text(encoding="utf-8").splitlines()[1].startswith("bare,,1,false,6.32156")


def test_hdf5_reads_back_with_units_and_what_it_was_computed_from(capsys: pytest.CaptureFixture[str]) -> None:
    answer = predicted(capsys, "steady", "--omega", "17.5", "20", "--beta", "0.25", "--out", "points.h5")
    file = open_to_read(Path("points.h5"))
    table = tables.read(group(file, "entry/points"))
    for name, column in table.items():
        assert column.values.tolist() == [point[name] for point in answer["points"]]
        assert column.description
    units = {name: column.unit for name, column in table.items()}
    assert (units["omega_rad_s"], units["alpha_2"], units["u1_max_m"]) == ("rad/s", "1", "m")
    file.close()
    with h5py.File("points.h5") as stored:
        assert stored.attrs["format"] == "rocking-bench prediction"
        for name in ("request", "specimen", "software"):
            assert json.loads(stored[f"entry/metadata/{name}"][()]) == answer[name]


SUFFIXES = {"rad/s": "rad_s", "m/s2": "m_s2", "m": "m", "rad": "rad", "s": "s", "Hz": "hz", "1/s": "per_s"}


@pytest.mark.parametrize("command", ["modes", "history", "steady", "spectrum", "map"])
def test_every_column_that_has_a_unit_ends_with_it(command: str) -> None:
    axes = {
        "modes": [],
        "history": ["--omega", "16", "--duration", "0.5"],
        "map": ["--omega", "16", "17", "--beta", "0.3", "0.4"],
    }.get(command, ["--omega", "16", "--beta", "0.4"])
    assert predict(command, *axes, "--out", "table.h5") == 0
    checked = 0
    with h5py.File("table.h5") as stored:
        for table in stored["entry"].values():
            for name, column in table.items() if isinstance(table, h5py.Group) else ():
                unit = column.attrs.get("units", "1")
                if unit != "1":
                    assert name.endswith(f"_{SUFFIXES.get(unit, unit.replace('/', '_per_'))}")
                    checked += 1
    assert checked >= 3


def test_histories_are_stored_sample_by_sample_and_run_by_run() -> None:
    assert predict("history", "--omega", "16", "17.5", "--duration", "1", "--out", "h.h5", "--csv", "h.csv") == 0
    file = open_to_read(Path("h.h5"))
    samples, runs = (tables.read(group(file, f"entry/{name}")) for name in ("histories", "runs"))
    file.close()
    assert runs["omega_rad_s"].values.tolist() == [16.0, 17.5]
    assert set(QUANTITIES) < set(samples)
    assert np.unique(samples["omega_rad_s"].values).tolist() == [16.0, 17.5]
    rows = Path("h.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + samples["time_s"].values.size


def test_ranges_are_exact_decimals() -> None:
    assert read_fields(SineRequest, {"omega": ["0.1:0.5:5", "12"]}) == {"omega": [0.1, 0.2, 0.3, 0.4, 0.5, 12.0]}
    default = MapRequest()
    assert (len(default.omega), len(default.beta)) == (100, 100)
    assert (default.omega[0], default.omega[-1], default.beta[0], default.beta[-1]) == (12.0, 21.0, 0.1, 1.2)


def test_significant_digits() -> None:
    given = np.array([123456.789, -0.00012345678, 0.0, 9.9999999])
    assert rounded(given, 4).tolist() == [123500.0, -0.0001235, 0.0, 10.0]
    assert np.isnan(rounded(np.array([np.nan]), 4)[0])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("steady --omega 0", "--omega = 0.0 is refused: it must be a number above 0"),
        ("steady --omega", "--omega = [] is refused"),
        ("steady --omega 16 x", "--omega = 'x' is refused"),
        ("steady --omega 16 16", "each value may occur only once"),
        ("steady --beta 0,25", "--beta = '0,25' is refused: write 0.25; separate values by spaces"),
        ("steady --beta 0.25,0.64", "--beta = '0.25,0.64' is refused: a comma is not a separator"),
        ("map --omega 21:12:10", "--omega = '21:12:10' is refused: the range descends: write 12:21:10"),
        ("steady --omega 16mm", "--omega = '16mm' is refused: mm (meter) does not have"),
        ("steady --omega 12:21", "--omega = '12:21' is refused: a range is start:stop:count"),
        ("steady --beta -1", "--beta = -1.0 is refused"),
        ("map --omega 1:2:10000 --beta 1:2:101", "at most 1000000 points"),
        ("map --omega 16", "--omega = [16.0] is refused: it must be two or more numbers"),
        ("steady --amplitude-factor 0", "--amplitude-factor = 0.0 is refused"),
        ("steady --distance 0", "--distance = 0.0 is refused: it must be a number above 0 m"),
        ("steady --distance x", "--distance = 'x' is refused"),
        ("steady --restitution-factor -1", "--restitution-factor = -1.0 is refused"),
        ("steady --restitution-factor 1.1", "--restitution-factor = 1.1 is refused"),
        ("steady --specimen absent.toml", "--specimen = 'absent.toml' is refused: there is no such file"),
        ("steady --specimen bad.toml", "bad.toml: frame.k1 = -1.0 is refused: it must be a number above 0 N/m"),
        ("steady --specimen odd.toml", "odd.toml: block = 3 is refused"),
        ("steady --specimen odd.toml --restitution-factor 1", "odd.toml: block = 3 is refused"),
        ("steady --solver euler", "--solver = 'euler' is refused"),
        ("steady --solver paper --members 20", "--members = 20 is refused: only the solver taylor computes this"),
        ("map --solver paper --outcomes", "--outcomes = True is refused: only the solver taylor"),
        ("map --solver dop853 --band", "--band = True is refused: only the solver taylor"),
        ("steady --tolerance 0", "--tolerance = 0.0 is refused"),
        ("history --solver paper --tolerance 1e-9", "use step with the solver paper"),
        ("history --steady --solver paper", "--solver = 'paper' is refused"),
        ("history --duration -1", "--duration = -1.0 is refused"),
        ("steady --plot figure.jpg", "--plot = 'figure.jpg' is refused: its name must end with .png"),
        ("steady --plot figure.png", "--plot = '12 points' is refused: at most 6 points"),
        ("steady --csv taken", "--csv = 'taken' is refused: the file exists and is never overwritten"),
        ("steady --out taken", "--out = 'taken' is refused: the file exists and is never overwritten"),
        ("map --plot taken.png", "--plot = 'taken.png' is refused: the file exists and is never overwritten"),
        ("steady --csv absent/points.csv", "the folder does not exist"),
        ("steady --csv same --out same", "--csv would write the same file"),
        ("modes --omega 16", "Unknown option"),
        ("nothing", "nothing"),
    ],
)
def test_bad_input_is_refused_in_one_line_before_anything_is_computed(
    capsys: pytest.CaptureFixture[str], arguments: str, said: str
) -> None:
    Path("bad.toml").write_text("[frame]\nk1 = -1.0\n", encoding="utf-8")
    Path("odd.toml").write_text("block = 3\n", encoding="utf-8")
    for name in ("taken", "taken.png"):
        Path(name).write_text("precious", encoding="utf-8")
    before = sorted(Path().rglob("*"))
    assert predict(*arguments.split()) == 2
    assert sorted(Path().rglob("*")) == before
    assert Path("taken").read_text(encoding="utf-8") == "precious"
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert shown.err.startswith("rockbench: error: ")
    assert said in shown.err


def test_a_scheduler_that_does_not_answer_is_a_failure_in_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sim.sweep.PATIENCE", 0.2)
    assert predict("map", "--omega", "16", "17", "--beta", "0.3", "0.4", "--scheduler", "tcp://127.0.0.1:9") == 1
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "tcp://127.0.0.1:9" in shown.err
    assert shown.err.count("rockbench: error: ") == 1


def test_help_gives_units_limits_and_defaults(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "240")
    assert predict("map", "--help") == 0
    shown = capsys.readouterr().out
    for text in ("[default: 12:21:100 rad/s]", "[default: 0.1:1.2:100]", "start:stop:count [rad/s]", "[default: 1.01]"):
        assert text in shown
    for name in MapRequest.model_fields:
        assert "--" + name.replace("_", "-") in shown
    assert predict("history", "--help") == 0
    shown = capsys.readouterr().out
    for name in HistoryRequest.model_fields:
        assert "--" + name.replace("_", "-") in shown
    # defaults that help states for the specimen are those of the specimen
    assert f"the specimen's, {Specimen().d:g} m" in shown
    assert f"the specimen's, {Specimen().block.restitution_factor:g}]" in shown


def _modules_after(*arguments: str) -> set[str]:
    program = f"import sys; from bench.app.cli.main import main; main({list(arguments)!r}); print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in ran.stdout.splitlines()[-1].split()}


def test_help_needs_no_numbers_and_a_prediction_no_drawing() -> None:
    heavy = {"numba", "scipy", "matplotlib", "h5py", "PySide6", "pyqtgraph", "nidaqmx", "grpc", "numpy"}
    assert not heavy & _modules_after("predict", "steady", "--help")
    loaded = _modules_after("predict", "steady", "--omega", "16", "--beta", "0.4", "--json")
    assert not {"matplotlib", "h5py", "PySide6", "pyqtgraph", "nidaqmx", "distributed"} & loaded
    assert "numba" in loaded


def test_a_map_says_on_request_what_the_sine_switched_on_comes_to(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "13:20:3", "--beta", "0.25:0.64:2", "--outcomes", "--json"]
    assert main(["predict", "map", *flags]) == 0
    points = json.loads(capsys.readouterr().out)["points"]
    assert {point["outcome"] for point in points} <= {"rocking", "resting", "other", "toppled", "failed"}
    toppled = [point for point in points if point["outcome"] == "toppled"]
    assert toppled
    for point in toppled:
        specimen = Specimen().coupled(point["beta"])
        switched_on = SineProgram([Sweep.dwell(120.0, point["amplitude_m_s2"], point["omega_rad_s"])])
        assert simulate(specimen, switched_on).end_time == pytest.approx(point["outcome_time_s"])
