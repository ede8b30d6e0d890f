"""The Python interface: its signatures, predictions beside those of the command line, runs, and campaigns read back."""

import inspect
import json
import lzma
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bench
from bench.analysis.signals import SIGNALS
from bench.app import run as running
from bench.app.cli.main import main
from bench.app.predictions import SteadyPrediction
from bench.app.session import SessionResult
from bench.datafile.reader import open_datafile
from bench.events import Acquired, Event, Subscriber
from sim.rocking import State
from sim.specimen import Block

pytestmark = pytest.mark.usefixtures("shared_results", "no_figures")
STORED = Path("tests/data/first_edition/harmonic_point.h5.xz")
QUICK = {"omega": 20, "beta": 0.25, "starts": 1, "ramp_time": 2, "settle_tolerance": 0.01, "measured_cycles": 8}


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded campaign with the running estimates of its twin."""
    path = tmp_path_factory.mktemp("stored") / "campaign.h5"
    path.write_bytes(lzma.decompress((Path(__file__).parents[3] / STORED).read_bytes()))
    return path


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("predict", "specimen=None, *, omega=None, beta=None, record=None, configuration=None, band=False, **options"),
        (
            "run",
            "protocol, parameters=None, /, *, configuration=None, specimen=None, seed=None, out=None, operator=None, "
            "realtime=False, progress=None, **more",
        ),
        ("open", "path"),
        ("read_configuration", "path"),
    ],
)
def test_signatures_are_those_documented_as_stable(name: str, arguments: str) -> None:
    signature = inspect.signature(getattr(bench, name))
    bare = [each.replace(annotation=inspect.Parameter.empty) for each in signature.parameters.values()]
    assert str(signature.replace(parameters=bare, return_annotation=inspect.Signature.empty)) == f"({arguments})"


def test_names_of_the_interface_are_pinned() -> None:
    names = {"Campaign", "Configuration", "InvalidInput", "Quantity", "Specimen"}
    assert set(bench.__all__) == names | {"open", "predict", "read_configuration", "run"}
    assert set(bench.__all__) <= set(dir(bench))
    assert inspect.signature(bench.Campaign.samples).parameters.keys() >= {"signal", "run", "coupled", "start", "stop"}
    with pytest.raises(AttributeError, match="nothing"):
        _ = bench.nothing


def test_importing_it_loads_nothing_until_a_name_is_used() -> None:
    code = "import sys, bench; bench.Specimen; print(*sorted(name for name in sys.modules if name.startswith('bench')))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.split() == ["bench"]


def test_steady_predictions_are_those_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["predict", "steady", "--omega", "20", "16", "--beta", "0.64", "0.25", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["points"]
    found = bench.predict(omega=[20, 16], beta=[0.64, 0.25], band=True)
    assert isinstance(found, SteadyPrediction)
    expected = {(row["layer"], row["beta"], row["omega_rad_s"]): row for row in rows}
    for name, branch in (("rocking", found.rocking), ("resting", found.resting)):
        assert branch.alpha_2.shape == (2, 2)
        for i, beta in enumerate(found.beta):
            for j, omega in enumerate(found.omega):
                row = expected.get((name, beta, omega))
                if row is None:
                    assert np.isnan(branch.alpha_2.values[i, j])
                    assert not branch.stable.values[i, j]
                    continue
                assert branch.alpha_2.values[i, j] == pytest.approx(row["alpha_2"], rel=1e-9)
                assert branch.alpha_2_high.values[i, j] == pytest.approx(row["alpha_2_high"], rel=1e-4)
                assert bool(branch.stable.values[i, j]) is row["stable"]
    single = bench.predict(omega=16, beta=0.25).rocking
    assert single.alpha_2.shape == ()
    assert float(single.alpha_2) == pytest.approx(float(found.rocking.alpha_2.values[1, 1]), rel=1e-9)
    assert (single.drift_max.unit, single.theta_max.unit) == ("m", "rad")
    assert bench.predict(omega="12:21:7", beta=0.25).rocking.alpha_2.shape == (7,)


def test_a_specimen_of_ones_own_and_one_from_a_file_agree(tmp_path: Path) -> None:
    (tmp_path / "specimen.toml").write_text("d = 0.12\n[block]\nrestitution_factor = 0.992\n", encoding="utf-8")
    own = bench.Specimen(d=0.12, block=Block(restitution_factor=0.992))
    one, other = (bench.predict(each, omega=16, beta=0.4) for each in (own, tmp_path / "specimen.toml"))
    assert float(one.rocking.alpha_2) == float(other.rocking.alpha_2)
    assert repr(own) == "Specimen(block=Block(restitution_factor=0.992), d=0.12)"
    assert repr(bench.Configuration()) == "BenchConfiguration()"


def test_a_record_gives_the_gains_of_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["predict", "seismic", "synthetic:kobe", "--beta", "0.25", "0.64", "--json"]) == 0
    rows = {row["beta"]: row for row in json.loads(capsys.readouterr().out)["gains"]}
    found = bench.predict(record="synthetic:kobe", beta=[0.64, 0.25])
    for beta, alpha, over in zip(found.beta, found.alpha_2, found.overturned, strict=True):
        assert bool(over) is rows[beta]["toppled"]
        if not over:
            assert alpha == pytest.approx(rows[beta]["alpha_2"], rel=1e-8)
    assert np.abs(found.motion).max() == pytest.approx(1.2 * bench.Specimen().uplift_acceleration, rel=1e-6)
    again = bench.predict(record=(found.motion.values, float(found.motion.time.values[1])), beta=0.25, trim=0)
    assert again.alpha_2.shape == ()


def test_modes_are_those_of_equations_12_to_14() -> None:
    found = bench.predict(beta=[0.4, 0.97])
    assert found.omega.shape == (2, 3)
    np.testing.assert_allclose(found.bare_omega, bench.Specimen().frame.natural_frequencies, rtol=1e-12)
    assert bench.predict(beta=0.4).shapes.shape == (3, 3)


@pytest.mark.parametrize(
    ("arguments", "item", "remedy"),
    [
        ({"omega": 16}, "beta", "label"),
        ({"omega": -1, "beta": 0.4}, "omega[0]", "above 0"),
        ({"omega": 16, "beta": 0.4, "peak_factor": 2}, "peak_factor", "amplitude_factor"),
        ({"omega": 16, "beta": 0.4, "record": "synthetic:kobe"}, "record", "not both"),
        ({"record": "synthetic:nowhere", "beta": 0.4}, "record", "pacoima"),
        ({"record": "synthetic:kobe", "beta": 0.4, "table_band": "3:1"}, "table_band", "ascend"),
        ({"record": State(), "beta": 0.4}, "record", "kobe.csv@unit=g"),
        ({"omega": State(), "beta": 0.4}, "omega[0]", "above 0"),
    ],
)
def test_a_prediction_names_item_and_remedy(arguments: dict[str, object], item: str, remedy: str) -> None:
    with pytest.raises(bench.InvalidInput) as refused:
        bench.predict(**arguments)  # type: ignore[call-overload]
    assert refused.value.item == item
    assert remedy in refused.value.allowed
    assert "State(" not in str(refused.value)


def test_samples_are_chosen_by_run_specimen_and_time(stored: Path) -> None:
    with bench.open(stored.parent) as campaign, open_datafile(stored) as record:
        both = campaign.samples("acceleration")
        first, second, third = campaign.runs
        assert len(both) == record.rows
        assert len(campaign.samples("u2", coupled=False)) == len(record.runs[0].rows)
        assert len(campaign.samples("u2", coupled=0.25)) == len(campaign.samples("u2", coupled=True))
        assert campaign.samples("u1", coupled=0.64).shape == (0,)
        part = campaign.samples("drive", start=second.start, stop=third.start)
        assert (part.unit, part.time.unit, len(part)) == ("V", "s", len(record.runs[1].rows))
        np.testing.assert_array_equal(part, record.runs[1].drive)
        assert first.stop == pytest.approx(second.start)
        u1, drift, u2 = (campaign.samples(name, run=2) for name in ("u1", "drift", "u2"))
        np.testing.assert_allclose(u1 + drift, u2, atol=1e-15)
        for wanted, item in (({"signal": "u3"}, "signal"), ({"signal": "u1", "run": 9}, "run")):
            with pytest.raises(bench.InvalidInput) as refused:
                campaign.samples(**wanted)  # type: ignore[arg-type]
            assert refused.value.item == item


def test_a_quantity_is_an_array_with_a_unit() -> None:
    given = bench.Quantity(np.array([1.0, -2.0]), "m")
    assert np.abs(given).max() == 2.0
    assert np.mean(given) == -0.5
    assert (2 * given).tolist() == [2.0, -4.0]
    assert (given > 0).tolist() == [True, False]
    assert (given[1].unit, float(given[1])) == ("m", -2.0)
    assert repr(given) == "[ 1., -2.] m"
    assert str(bench.Quantity(np.array(0.25), "1")) == "0.25"


@dataclass
class Followed:
    """A run on the simulated bench, the blocks of signals that its guard had, and its file while it was written."""

    campaign: bench.Campaign
    blocks: list[Acquired]
    said: list[tuple[str, float]]
    growing: list[tuple[str, int]]


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> Followed:
    folder = tmp_path_factory.mktemp("run") / "point"
    blocks: list[Acquired] = []
    said: list[tuple[str, float]] = []
    growing: list[tuple[str, int]] = []
    session = running.run_session

    def keep(event: Event) -> None:
        if isinstance(event, Acquired):
            blocks.append(event)

    def watched(*given: Any, subscribers: Sequence[Subscriber], **more: Any) -> SessionResult:
        return session(*given, subscribers=[*subscribers, keep], **more)

    def progress(text: str, share: float) -> None:
        said.append((text, share))
        if share > 0.5 and blocks and not growing:
            with bench.open(folder) as unfinished:
                growing.append((unfinished.status, len(unfinished.samples("drift"))))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench.app.run.run_session", watched)
        campaign = bench.run("harmonic", QUICK, seed=3, out=folder, progress=progress)
    return Followed(campaign, blocks, said, growing)


@pytest.fixture
def campaign(followed: Followed) -> bench.Campaign:
    return followed.campaign


def test_a_run_is_followed_and_its_growing_file_read(followed: Followed) -> None:
    assert all(0.0 <= share <= 1.0 for _, share in followed.said)
    assert any("20 rad/s" in text for text, _ in followed.said)
    ((status, samples),) = followed.growing
    assert status == "running"
    assert samples > 0


def test_samples_are_the_signals_that_the_guard_had(followed: Followed) -> None:
    campaign = followed.campaign
    for run in campaign.runs:
        # before the zero is taken the guard counts from that of the run before
        zeroed = [
            each for each in followed.blocks if each.run == run.number and each.block.first > 3 * campaign.sample_rate
        ]
        assert len(zeroed) > 10
        rows = np.concatenate([each.block.first + np.arange(len(each.signals)) for each in zeroed])
        signals = np.concatenate([each.signals for each in zeroed])
        for column, name in enumerate(SIGNALS):
            np.testing.assert_array_equal(campaign.samples(name, run=run.number).values[rows], signals[:, column])


def test_a_run_is_that_of_the_command_line(campaign: bench.Campaign, tmp_path: Path) -> None:
    flags = [word for name, value in QUICK.items() for word in (f"--{name.replace('_', '-')}", str(value))]
    assert main(["run", "harmonic", *flags, "--seed", "3", "--out", str(tmp_path / "run")]) == 0
    with bench.open(tmp_path / "run") as other:
        assert other.points["alpha_2"].values.tolist() == campaign.points["alpha_2"].values.tolist()
        assert other.configuration == campaign.configuration
    assert campaign.status == "completed"
    assert campaign.points["alpha_2"].unit == "1"
    assert campaign.parameters["omega"] == [20.0]
    assert campaign.specimen == bench.Specimen()
    assert "harmonic, completed, 1 point>" in repr(campaign)


@pytest.mark.parametrize(
    ("arguments", "item"),
    [
        ({"omgea": 16}, "omgea"),
        ({"omega": [16, -1]}, "omega[1]"),
        ({"configuration": "absent.toml"}, "configuration file"),
        ({"seed": -1}, "seed"),
        ({"configuration": bench.Configuration(backend="hardware")}, "operator"),
        ({"configuration": bench.Configuration(backend="hardware"), "seed": 1}, "seed"),
    ],
)
def test_a_run_that_is_refused_leaves_nothing(
    arguments: dict[str, object], item: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(bench.InvalidInput) as refused:
        bench.run("harmonic", **arguments)  # type: ignore[arg-type]
    assert refused.value.item == item
    assert not list(tmp_path.iterdir())


def test_results_are_never_overwritten(campaign: bench.Campaign) -> None:
    with pytest.raises(bench.InvalidInput, match="never overwritten") as refused:
        bench.run("harmonic", QUICK, out=campaign.path.parent)
    assert refused.value.item == "out"


def test_an_operator_who_declines_ends_the_run(tmp_path: Path) -> None:
    asked: list[str] = []

    def decline(request: str) -> bool:
        asked.append(request)
        return False

    with bench.run("harmonic", QUICK, out=tmp_path / "run", operator=decline) as campaign:
        assert campaign.status == "aborted"
        assert asked[0] in campaign.summary
        assert campaign.points == {}


@pytest.mark.skipif(os.name == "nt", reason="a process cannot interrupt itself there as a terminal does")
def test_an_interrupt_leaves_an_aborted_file_with_the_output_at_zero(tmp_path: Path) -> None:
    folder = tmp_path / "run"

    def interrupt() -> None:
        # a campaign is being measured once its file grows
        while not (folder / "campaign.h5").exists():
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt, match="its results are in"):
        bench.run("harmonic", QUICK, out=folder)
    assert signal.getsignal(signal.SIGINT) is before
    with bench.open(folder) as campaign:
        assert campaign.status == "aborted"
        drive = campaign.samples("drive")
        assert not len(drive) or drive.values[-1] == 0.0
