"""Results anew: the same with the same settings, what other settings make of the samples, and never over the old."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from hashlib import sha256
from math import tau
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.app.cli.analyse_settings import choice_of
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_specimen
from bench.config.sections import Acquisition, Simulation
from bench.control.oscillator import Segment
from bench.control.starts import Start
from bench.datafile.reader import open_datafile
from bench.guard.limits import Limits
from drivers.simulated import SimulatedRig
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint
from sim.gain import predict_gain
from sim.identified import Finding, Identified
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.recorded import recorded

pytestmark = pytest.mark.usefixtures("no_figures")

BENCH = BenchConfiguration(
    acquisition=Acquisition(block_duration=0.2, lead=0.05),
    simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0)),
    limits=Limits(drift=0.2, displacement=0.095),
)
OMEGA, BETA = 20.0, 0.25
ASKED = HarmonicParameters(
    omega=(OMEGA,),
    beta=(BETA,),
    amplitude_factor=1.01,
    ramp_time=3.0,
    measured_cycles=8,
    settle_tolerance=0.01,
    amplitude_tolerance=0.01,
    phase_tolerance=0.02,
    distortion_tolerance=0.02,
    harmonics=3,
    starts=2,
)


def _planned(_specimen: Specimen, omega: float, amplitude: float, *_: object) -> tuple[Start, ...]:
    """A start that topples the block, and a ramp that leaves it at rest: good starts take long to find."""
    shaken = Segment(2.0, 2.9 * amplitude, 12.0)
    violent = Start("violent", (shaken, replace(shaken, duration=3.0), Segment(2.0, amplitude, omega)), 0.1)
    return violent, Start("ramp", (Segment(3.0, amplitude, omega),), 1.0)


@pytest.fixture(scope="module", autouse=True)
def _no_planning() -> object:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("protocols.harmonic.campaign.plan_starts", _planned)
        yield


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bare frame and one spring, whose block falls in the first start and rests in the second."""
    path = tmp_path_factory.mktemp("analyse") / "campaign.h5"
    rig = SimulatedRig(BENCH.simulation.bench, BENCH.specimen, seed=1, lead=BENCH.lead_samples)
    metadata = {"protocol": "harmonic", "parameters": ASKED.model_dump_json()}
    ending = recorded(path, HarmonicCampaign(ASKED, BENCH).plan(), rig, BENCH, HarmonicPoint, metadata)
    assert ending.status == "completed"
    with open_datafile(path) as record:
        assert any("The block has fallen" in event.text for event in record.events)
    return path


def _analysed(path: Path, capsys: pytest.CaptureFixture[str], *settings: str) -> dict[str, object]:
    changes = [part for setting in settings for part in ("--set", setting)]
    assert main(["analyse", str(path), "--json", *changes]) == 0
    (point,) = json.loads(capsys.readouterr().out)["points"]
    return point


def test_the_same_settings_come_to_the_same_results_in_a_file_beside_the_old(
    campaign: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, earlier = campaign.read_bytes(), campaign.with_name("campaign.analysis-1.h5")
    earlier.write_text("somebody's")
    assert main(["analyse", str(campaign)]) == 0
    assert "campaign.analysis-2.h5" in capsys.readouterr().out
    assert (campaign.read_bytes(), earlier.read_text()) == (before, "somebody's")
    with open_datafile(campaign) as record, h5py.File(campaign.with_name("campaign.analysis-2.h5")) as file:
        (stored,) = record.points
        for name, value in stored.items():
            for table in ("points", "recorded_points"):
                (kept,) = file["entry"][table][name][:]
                kept = kept.decode() if isinstance(kept, bytes) else kept
                assert kept == value if value is not None else kept in ("", -1) or np.isnan(kept)
        assert file["entry/points/alpha_2"].attrs["units"] == "1"
        assert file["entry/original/file"][()] == b"campaign.h5"
        assert file["entry/original/sha256"][()].decode() == sha256(before).hexdigest()
        assert json.loads(file["entry/process/settings"][()]) == {}
        assert json.loads(file["entry/process/used"][()])["peak"] == "judged"


def test_the_first_of_two_modulated_motions_is_analysed_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is the recorded one, although the last cycles of the second one are nearer to its mean amplitude."""

    def planned(_specimen: Specimen, omega: float, amplitude: float, *_: object) -> tuple[Start, ...]:
        end = Segment(1.0, amplitude, omega)
        return Start("strong", (Segment(2.0, 1.8 * amplitude, omega), end), 0.5), Start("ramp", (end,), 0.5)

    monkeypatch.setattr("protocols.harmonic.campaign.plan_starts", planned)
    asked = ASKED.model_copy(update={"settle_limit": 10.0, "settle_tolerance": 1e-4, "hold": False})
    rig = SimulatedRig(BENCH.simulation.bench, BENCH.specimen, seed=1, lead=BENCH.lead_samples)
    metadata = {"protocol": "harmonic", "parameters": asked.model_dump_json()}
    path = tmp_path / "campaign.h5"
    assert (
        recorded(path, HarmonicCampaign(asked, BENCH).plan(), rig, BENCH, HarmonicPoint, metadata).status == "completed"
    )
    with open_datafile(path) as record:
        (stored,) = record.points
    assert (stored["status"], stored["starts_tried"], stored["predicted_stable"]) == ("modulated", 2, True)
    again = _analysed(path, capsys)
    for name in ("alpha_2", "amplitude_m_s2", "settle_time_s", "cycles_measured"):
        assert again[name] == stored[name]


def test_cycles_and_harmonics_are_those_that_were_asked_for(campaign: Path, capsys: pytest.CaptureFixture[str]) -> None:
    point = _analysed(campaign, capsys, "measured_cycles=5", "harmonics=1", "peak=mean")
    assert point["cycles_measured"] == 5
    with open_datafile(campaign) as record:
        stop = next(event.time for event in reversed(record.events) if "running -> stopping" in event.text)
        blocks, last = record.blocks, record.runs[-1]
        row = int(blocks["row"][np.searchsorted(blocks["time"], stop)]) - last.rows.start
        window = slice(row - round(5 * tau / OMEGA * record.sample_rate), row)
        drift = last.channels["laser_2"][window] - last.channels["laser_1"][window]
        rest = slice(200, 1800)
        drift -= float(np.mean(last.channels["laser_2"][rest] - last.channels["laser_1"][rest]))
        time = last.time[window]
    # an independent fit of one sine and a mean, over five cycles up to the end of the test
    basis = np.column_stack((np.ones(time.size), np.cos(OMEGA * time), np.sin(OMEGA * time)))
    _, cosine, sine = np.linalg.lstsq(basis, drift, rcond=None)[0]
    assert point["drift_peak_m"] == pytest.approx(np.hypot(cosine, sine), rel=2e-3)


def test_accuracies_and_specimen_are_those_that_were_given(
    campaign: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    with open_datafile(campaign) as record:
        (old,) = record.points
    exact = ("laser_mismatch", "laser_resolution", "laser_linearity", "laser_timing", "table_scale")
    stiffer = 1.1 * BENCH.specimen.frame.k2
    point = _analysed(campaign, capsys, *(f"analysis.{name}=0" for name in exact), f"specimen.frame.k2={stiffer}")
    # lasers without linearity errors are not corrected
    assert point["alpha_2"] != old["alpha_2"]
    assert point["alpha_2"] == pytest.approx(old["alpha_2"], abs=old["alpha_2_uncertainty"])
    left = {name: part for name, part in json.loads(str(point["uncertainty_parts"])).items() if part > 0.0}
    assert set(left) == {"scatter of the cycles", "remaining transient"}
    assert point["alpha_2_uncertainty"] == pytest.approx(2.0 * np.hypot(*left.values()), rel=0.01)
    assert float(str(point["alpha_2_uncertainty"])) < float(str(old["alpha_2_uncertainty"]))
    frame = Frame(**(BENCH.specimen.frame.model_dump() | {"k2": stiffer}))
    specimen = Specimen(frame=frame, beta=BETA)
    prediction = predict_gain(
        specimen, OMEGA, float(str(point["amplitude_m_s2"])), float(str(point["bare_amplitude_m_s2"]))
    )
    assert point["alpha_2_predicted"] == prediction.branches[str(point["layer"])].alpha_2
    assert point["alpha_2_predicted"] != old["alpha_2_predicted"]
    # the same by way of a file
    (tmp_path / "bench.toml").write_text(
        "[analysis]\n" + "\n".join(f"{name} = 0.0" for name in exact) + f"\n[specimen.frame]\nk2 = {stiffer}\n"
    )
    assert main(["analyse", str(campaign), "--json", "--config", str(tmp_path / "bench.toml")]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["points"] == [point]
    assert set(shown["settings"]) == {"analysis", "specimen"}


def test_a_configuration_without_a_specimen_file_keeps_what_was_identified(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = {"k1": 210.0, "k2": 55.0, "restitution_factor": 0.97, "k_c:0.25": 54.0}
    findings = tuple(
        Finding(name=name, value=value, standard_uncertainty=0.01 * value, source="test", date=datetime.now(UTC))
        for name, value in found.items()
    )
    known = BENCH.model_copy(update={"identified": Identified(findings=findings)})
    monkeypatch.setattr("bench.replay.session.stored_configuration", lambda _record: known)
    bench, specimen = tmp_path / "bench.toml", tmp_path / "specimen.json"

    def left(text: str) -> tuple[str, ...]:
        bench.write_text(text)
        with open_datafile(campaign) as record:
            identified = choice_of(record, (), bench).changed.identified
        return () if identified is None else identified.names

    assert left("[analysis]\nlaser_linearity = 0.0\n") == tuple(found)
    # an assumed value that the file changes replaces the identified one, an unchanged one does not
    frame = f"[specimen.frame]\nk1 = {BENCH.specimen.frame.k1}\nk2 = 60.0\n"
    assert left(frame) == ("k1", "restitution_factor", "k_c:0.25")
    assert left("[[specimen.springs]]\nlabel = 0.25\nk_c = 53.0\n") == ("k1", "k2", "restitution_factor")
    write_specimen(specimen, Identified(findings=findings[:1]))
    assert left('specimen_file = "specimen.json"\n') == ("k1",)


def test_results_that_do_not_come_again_are_no_ground_for_others(
    campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "changed.h5"
    path.write_bytes(campaign.read_bytes())
    with h5py.File(path, "r+") as file:
        file["entry/points/drift_peak_m"][0] *= 1.01
    assert main(["analyse", str(path)]) == 1
    assert "does not reproduce the recording" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--set", "peak=tallest"], "--set peak"),
        (["--set", "measured_cycles=3"], "--set measured_cycles"),
        (["--set", "specimen.frame.k1=213,44"], "write 213.44; separate values by spaces"),
        (["--set", "specimen.frame.k1=20 mm"], "not have the dimension of N/m"),
        (["--set", "peek=mean"], "the nearest is peak"),
        (["--set", "limits.velocity=1"], "only the configuration tables analysis, specimen, uncertainty"),
        (["--set", "specimen.frame.m1.kg=1"], "there is no table m1"),
        (["--set", "analysis.laser_slop=0"], "--set analysis.laser_slop"),
        (["--set", "peak"], "KEY=VALUE; --list shows all of them"),
        (["--set", "nothing=1"], "settle_tolerance, and analysis.KEY, specimen.KEY, uncertainty.KEY: --list"),
    ],
)
def test_settings_that_there_are_not_are_refused_in_a_line(
    campaign: Path, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    there = sorted(campaign.parent.iterdir())
    assert main(["analyse", str(campaign), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert sorted(campaign.parent.iterdir()) == there


def test_nothing_is_overwritten(campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "mine.h5"
    taken.write_text("mine")
    assert main(["analyse", str(campaign), "--out", str(taken)]) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert main(["analyse", str(campaign), "--out", str(campaign)]) == 2
    assert taken.read_text() == "mine"


def test_settings_are_listed_with_value_and_unit(campaign: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyse", str(campaign), "--list"]) == 0
    shown = capsys.readouterr().out
    for line in ('peak "judged"', "analysis.laser_resolution 5e-05 m", "specimen.frame.k2 56.45 N/m"):
        assert line in " ".join(shown.split())


def test_another_protocol_is_carried_out_again_unless_it_would_have_driven_otherwise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("--omega", "12", "18", "27", "40", "--cycles", "4", "--yes")
    assert main(["check", *asked, "--out", str(tmp_path)]) == 0
    file = str(tmp_path / "campaign.h5")
    capsys.readouterr()
    assert main(["analyse", file, "--set", "latency=0.001"]) == 0
    shown = capsys.readouterr().out
    assert "passed" in shown
    assert "failed" in shown
    with h5py.File(tmp_path / "campaign.analysis-1.h5") as analysis:
        verdicts = [text.decode() for text in analysis["entry/points/verdict"][:]]
        assert verdicts.count("failed") == 1
        assert b"failed" not in analysis["entry/recorded_points/verdict"][:]
        assert json.loads(analysis["entry/process/settings"][()]) == {"latency": 0.001}
    assert main(["analyse", file, "--set", "velocity=0.05"]) == 2
    assert "change the drive of the table (the drive first differs at sample" in capsys.readouterr().err
    assert not (tmp_path / "campaign.analysis-2.h5").exists()


def test_settings_that_need_more_than_was_recorded_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = tmp_path / "bench.toml"
    bench.write_text("[acquisition]\nblock_duration = 0.2\n[simulation.bench]\nsample_rate = 1000.0\n")
    command = ["run", "free-vibration", "--repeats", "1", "--window", "10", "--config", str(bench), "--yes"]
    assert main([*command, "--out", str(tmp_path / "run")]) == 0
    file = tmp_path / "run" / "campaign.h5"
    capsys.readouterr()
    assert main(["analyse", str(file), "--set", "repeats=2", "--json"]) == 2
    assert "need more than was recorded (no recorded run remains" in capsys.readouterr().err
    assert not [*file.parent.glob("*.analysis-*")]
    # a result file for other runs is written beside the analysis, and overwritten as little
    taken = tmp_path / "again.specimen.json"
    taken.write_text("mine")
    assert main(["analyse", str(file), "--out", str(tmp_path / "again.h5")]) == 2
    assert "again.specimen.json exists" in capsys.readouterr().err
    assert not (tmp_path / "again.h5").exists()
    beside = file.with_name("campaign.analysis-1.specimen.json")
    beside.write_text("mine")
    assert main(["analyse", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["file"].endswith("campaign.analysis-2.h5")
    assert beside.read_text() == "mine"


def test_the_list_of_settings_is_one_object_too(campaign: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyse", str(campaign), "--list", "--json"]) == 0
    settings = json.loads(capsys.readouterr().out)["settings"]
    assert settings["specimen.frame.k2"]["now"] == 56.45
    assert settings["specimen.frame.k2"]["unit"] == "N/m"
