"""The report of a seismic campaign from a file made by hand: gains, statement, and what is said of missing plays."""

import json
from html import unescape
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.analysis.signals import ACCELERATION, DRIFT, SignalMap
from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.app.reports.limits import limits_section
from bench.app.reports.report import campaign_report, damage_notice
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.datafile.tables import Column
from bench.document.campaign import Campaign
from bench.document.document import Listing, Picture, Table
from bench.engine.steps import Arm, OperatorAction, Plan, Play, Publish, RampOut
from bench.events import PointFinished, Warned
from bench.figures.earthquake_figure import DriftPicture, drift_figure
from bench.live_values import RunningGain
from bench.testing.loopback import LoopbackRig
from drivers.rig import Channel, Counts, OperatorTask
from protocols.earthquake.measurement import GainMonitor
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint, PointStatus
from protocols.earthquake.records import shakings
from protocols.earthquake.report import histories_parts, played_records, seismic_sections, signals_of
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.recorded import recorded

NAME = "synthetic pacoima"
NAMES = ("table_displacement", "table_acceleration", "laser_1", "laser_2")


def point(beta: float, alpha_2: float | None) -> EarthquakePoint:
    if alpha_2 is None:
        lost = {"status": PointStatus.OVERTURNED, "overturned_s": 6.5, "reason": "the block overturned"}
        return EarthquakePoint.model_validate({"record": NAME, "beta": beta, "pga_target_m_s2": 1.4715, **lost})
    return EarthquakePoint(
        record=NAME,
        beta=beta,
        status=PointStatus.MEASURED,
        alpha_2=alpha_2,
        alpha_2_uncertainty=0.012,
        alpha_2_predicted=alpha_2 + 0.01,
        alpha_2_low=alpha_2 - 0.1,
        alpha_2_high=alpha_2 + 0.1,
        agrees=True,
        alpha_1=0.5,
        alpha_1_uncertainty=0.01,
        alpha_1_predicted=0.62,
        alpha_1_low=0.55,
        alpha_1_high=0.7,
        alpha_1_agrees=False,
        pga_target_m_s2=1.4715,
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("seismic") / "made.h5"
    configuration = BenchConfiguration()
    parameters = EarthquakeParameters(records=("synthetic:pacoima",), table_band="1.5:25")
    channels = tuple(Channel(name, "displacement", "m", 1e-6, 0.0, (-32768, 32767), "made") for name in NAMES)
    betas = np.array([0.1, 0.25, 0.5])
    prediction = {
        "record": Column(np.array([NAME] * 3), "", "name"),
        "beta": Column(betas, "1", "stiffness ratio"),
        "alpha_2": Column(np.array([0.9, 0.8, np.nan]), "1", "gain"),
    }
    recorder = Recorder(
        path,
        channels=channels,
        sample_rate=2000.0,
        point_type=EarthquakePoint,
        metadata={
            "protocol": "earthquake",
            "parameters": parameters.model_dump_json(),
            "configuration": configuration.model_dump_json(),
            "specimen": configuration.specimen.model_dump_json(),
            "devices": json.dumps({"backend": "hardware"}),
            "operator": "N. N.",
            "notes": "the new springs",
            "git": "0123456789abcdef0123456789abcdef01234567+",
        },
        tables={"prediction": prediction},
    )
    recorder(Warned("the table's temperature is near its limit", time=61.5))
    # a gain that was told although no sample came: nothing was played
    recorder(RunningGain(NAME, 0.25, 1.0, 0.01, 0.8, 0.8, time=1.0))
    recorder(PointFinished(point(0.64, None), time=2.0))
    recorder(PointFinished(point(0.25, 0.812), time=3.0))
    recorder.close("stopped", "the operator asked for it")
    return path


def test_gains_statement_and_curves_stand_in_the_section(file: Path) -> None:
    with open_datafile(file) as record:
        (section,) = seismic_sections(Campaign(file, record))
        assert played_records(record) == []
    tables = [part for part in section.parts if isinstance(part, Table)]
    gains, first_storey, _, statement = tables
    row = dict(zip([column.title for column in first_storey.columns], first_storey.rows[0], strict=True))
    assert (row["α₁ measured"], row["95 % interval"], row["agrees"]) == ("0.500 ± 0.010", "0.550 to 0.700", "NO")
    assert [row[1] for row in gains.rows] == ["0.25", "0.64"]
    assert gains.rows[0][3] == "0.812 ± 0.012"
    assert gains.rows[0][5] == "0.712 to 0.912"
    assert gains.rows[1][2:4] == ["overturned", "–"]
    assert "1.5 to 25 Hz" in statement.caption
    measured = next(row for row in statement.rows if row[0] == "measured")
    # the block that toppled counts against alpha_2 < 1
    assert measured[1:4] == ["does not hold", "0.812", "does not hold"]
    (picture,) = [part for part in section.parts if isinstance(part, Picture)]
    assert {panel.get_xlabel() for panel in picture.figure.axes if panel.get_title(loc="left")} == {r"$\beta$"}
    assert any(isinstance(part, Listing) and "0.64: the block overturned" in part.items[0] for part in section.parts)


def test_an_end_before_its_time_and_warnings_are_told(file: Path) -> None:
    with open_datafile(file) as record:
        section = limits_section(Campaign(file, record))
    said = " ".join(str(part) for part in section.parts)
    assert "stopped" in said
    assert "1:01.5 min  the table's temperature is near its limit" in said


@pytest.mark.parametrize("rest", [2.0, 0.5])
def test_what_was_played_begins_at_the_sample_at_which_its_drive_began(tmp_path: Path, rest: float) -> None:
    """A table that repeats the drive sample by sample: what the report takes of it is the drive that was handed over.

    Neither play fills its last block, the second has a beginning of its own within a longer run.
    """
    rate = 1000.0
    bench = BenchConfiguration(
        acquisition=Acquisition(lead=0.1), simulation=Simulation(bench=VirtualBenchParameters(sample_rate=rate))
    )
    random = np.random.default_rng(3)

    def shaking(n: int) -> np.ndarray:
        smooth = np.convolve(random.standard_normal(n + 400), np.hanning(200), "valid")[:n]
        window = np.hanning(n)
        return 0.8 * window * smooth / np.abs(smooth).max()

    volts = {("one", None): shaking(1234), ("one", 0.25): shaking(1234), ("two", 0.25): shaking(2351)}

    def plan() -> Plan:
        for (name, beta), drive in volts.items():
            yield OperatorAction(OperatorTask.REMOVE_BLOCK, Specimen().bare(), "Take the block off.")
            yield Arm(rest)
            yield Play(drive, GainMonitor(name, beta, rate))
            yield RampOut()

    ending = recorded(tmp_path / "run.h5", plan(), LoopbackRig(), bench, EarthquakePoint)
    assert ending.status == "completed", ending.reason
    with open_datafile(tmp_path / "run.h5") as record:
        plays = played_records(record)
        assert [(play.name, play.beta) for play in plays] == list(volts)
        signals = SignalMap(record.channels, bench.laser_reference)
        for play, drive in zip(plays, volts.values(), strict=True):
            shown = signals_of(record, signals, play, rest)
            assert len(shown) == drive.size
            # the loopback's counts are thousandths
            np.testing.assert_allclose(shown[:, ACCELERATION], drive, atol=5.1e-4)


class Swinging(LoopbackRig):
    """Its second storey swings for some seconds after the rig is armed, and hangs 3 mm beside its zero at rest."""

    def begin(self) -> None:
        self.samples = 0

    def respond(self, volts: np.ndarray) -> Counts:
        t = (self.samples + np.arange(volts.size)) / self.sample_rate
        self.samples += volts.size
        self.response["laser_2"] = lambda driven: 0.02 * driven + 0.003 + 0.05 * np.exp(-t) * np.sin(9.0 * t + 1.0)
        return super().respond(volts)


def test_the_zero_of_the_drift_is_that_of_the_storeys_at_rest(tmp_path: Path) -> None:
    bench = BenchConfiguration(
        acquisition=Acquisition(lead=0.1), simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0))
    )
    drive = 0.8 * np.hanning(1000) * np.sin(0.02 * np.arange(1000))

    def plan() -> Plan:
        yield Arm(1.0)
        yield Play(drive, GainMonitor("one", None, 1000.0))
        yield RampOut()

    assert recorded(tmp_path / "run.h5", plan(), Swinging(), bench, EarthquakePoint).status == "completed"
    with open_datafile(tmp_path / "run.h5") as record:
        (play,) = played_records(record)
        # several seconds passed before the storeys were at rest
        assert play.start - play.run > 3000
        drift = signals_of(record, SignalMap(record.channels, bench.laser_reference), play, 1.0)[:, DRIFT]
        expected = (0.02 - 0.001) * drive
        np.testing.assert_allclose(drift, expected, atol=2.1e-3)
        assert abs(float(np.mean(drift - expected))) < 3e-4


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_a_test_that_ended_early_has_no_predicted_drift(tmp_path: Path, share: float) -> None:
    """The motion of the table is evaluated from signals that end at rest."""
    rate = 1000.0
    bench = BenchConfiguration(
        acquisition=Acquisition(lead=0.1), simulation=Simulation(bench=VirtualBenchParameters(sample_rate=rate))
    )
    parameters = EarthquakeParameters(records=("synthetic:pacoima",), table_band="1.5:25", decay=0.5)
    (shaking,) = shakings(parameters, bench)
    motion = shaking.target.acceleration

    def plan() -> Plan:
        for beta, played in ((None, 1.0), (0.25, share)):
            yield Arm(parameters.rest)
            drive = motion[: round(played * motion.size)].copy()
            drive *= np.minimum(1.0, 0.01 * np.minimum(np.arange(drive.size), np.arange(drive.size)[::-1]))
            yield Play(
                shaking.volts(drive, parameters.decay) if played == 1.0 else drive, GainMonitor(NAME, beta, rate)
            )
            yield RampOut()
        yield Publish(PointFinished(point(0.25, 0.8 if share == 1.0 else None)))

    rig, random = LoopbackRig(), np.random.default_rng(3)
    for name, factor in (("laser_1", 0.001), ("laser_2", 0.02)):
        # a constant reading under a drive would be a fault
        rig.response[name] = lambda volts, factor=factor: np.where(
            volts == 0.0, 0.0, factor * volts + 1e-3 * random.standard_normal(volts.size)
        )
    metadata = {
        "protocol": "earthquake",
        "parameters": parameters.model_dump_json(),
        "specimen": bench.specimen.model_dump_json(),
    }
    ending = recorded(tmp_path / "run.h5", plan(), rig, bench, EarthquakePoint, metadata)
    assert ending.status == "completed", ending.reason
    with open_datafile(tmp_path / "run.h5") as record:
        _, drifts = (
            part for part in histories_parts(Campaign(tmp_path / "run.h5", record)) if isinstance(part, Picture)
        )
    labels = [str(line.get_label()) for line in drifts.figure.axes[0].get_lines()]
    assert sum("predicted" in label for label in labels) == (2 if share == 1.0 else 1)
    assert ("no prediction for tests that ended early" in drifts.caption) == (share < 1.0)


def test_a_damaged_file_is_reported_and_says_so_first(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.h5"
    path.write_bytes(file.read_bytes())
    with h5py.File(path, "r+") as changed:
        changed["entry/points/alpha_2"][1] = 0.5
    assert main(["report", str(path), "--html", str(tmp_path / "r.html")]) == 0
    (warning,) = capsys.readouterr().err.splitlines()
    assert warning.startswith("rockbench: warning:")
    assert "/entry/points/alpha_2" in warning
    text = unescape((tmp_path / "r.html").read_text(encoding="utf-8"))
    assert text.index("DAMAGED OR CHANGED") < text.index("Tests:")
    assert "/entry/points/alpha_2 was changed" in text
    # what the file does not have is one line, not a section
    assert "The file contains no harmonic test." in text
    assert [key for key in ("results", "spectra", "map", "histories") if f'id="{key}"' in text] == []


def test_the_report_says_who_with_what_software_and_which_parameters(file: Path) -> None:
    with open_datafile(file) as record:
        assert not damage_notice(Campaign(file, record))
        document = campaign_report(Campaign(file, record, EarthquakeParameters), load_protocol("earthquake"))
    assert "Operator: N. N. Notes: the new springs." in " ".join(str(part) for part in document.summary)
    facts, parameters, *_ = (part for part in document.sections[-1].parts if isinstance(part, Table))
    known = dict(facts.rows)
    assert known["operator"] == "N. N."
    assert "git 0123456789abcdef0123456789abcdef01234567, files changed since" in known["recorded by"]
    assert "git " in known["reported by"]
    assert [column.title for column in parameters.columns] == ["parameter", "option", "value", "unit"]
    rows = {row[1]: row for row in parameters.rows}
    assert rows["--decay"] == ["duration of the free vibration measured after a record", "--decay", "5", "s"]
    assert rows["FILE"][2] == "synthetic:pacoima"


def test_measured_and_predicted_drifts_have_their_own_intervals() -> None:
    """At 2048 1/s, every 20th sample is drawn, but the prediction has a value every 10 ms."""
    measured, predicted = np.sin(np.arange(300.0)), np.cos(np.arange(200.0))
    figure = drift_figure([DriftPicture("one", None, 20.0 / 2048.0, measured, predicted, 0.01)])
    ends = [float(line.get_xdata()[-1]) for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 2]
    assert sorted(ends) == pytest.approx([1.99, 299 * 20.0 / 2048.0])
