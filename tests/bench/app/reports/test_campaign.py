"""The report of a campaign from its file: a short harmonic run on the simulated bench, and files that are refused."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pypdfium2 import PdfDocument

from bench.analysis.signals import SignalMap
from bench.app.cli.main import main
from bench.app.reports import report
from bench.app.reports.report import campaign_report
from bench.datafile.reader import open_datafile
from bench.document import gain_map
from bench.document.campaign import Campaign
from bench.document.document import Document, Picture, Section, Table
from protocols.harmonic.report_cycles import PERIODS, SAMPLES, Dwells
from sim.gain import predict_gain

pytestmark = pytest.mark.usefixtures("shared_results", "no_figures")
SHORT = ["--omega", "20", "--beta", "0.25", "--starts", "1", "--ramp-time", "2", "--measured-cycles", "8"]
LOOSE = ["--settle-tolerance", "0.01", "--amplitude-tolerance", "0.01"]


NOTE = "<script>alert(1)</script> 5 % & #[x]"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "run"
    people = ["--operator", "<b>Ann</b>", "--note", NOTE]
    assert (
        main(["run", "harmonic", "--yes", "--json", "--out", str(folder), "--seed", "7", *people, *SHORT, *LOOSE]) == 0
    )
    return folder / "campaign.h5"


@dataclass(frozen=True)
class Reported:
    """The document of the command, and its two files; something else was in `html` before."""

    document: Document
    html: Path
    pdf: Path


@pytest.fixture(scope="module")
def reported(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Reported:
    folder, made = tmp_path_factory.mktemp("report"), list[Document]()
    html, pdf = folder / "a.html", folder / "a.pdf"
    html.write_text("precious", encoding="utf-8")

    def kept(*given: Any) -> Document:
        made.append(campaign_report(*given))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gain_map, "STEP", 1.0)
        patch.setattr(gain_map, "BETA_STEP", 0.2)
        patch.setattr(report, "campaign_report", kept)
        assert main(["report", str(file), "--html", str(html), "--pdf", str(pdf), "--overwrite"]) == 0
    (document,) = made
    return Reported(document, html, pdf)


@pytest.fixture(scope="module")
def document(reported: Reported) -> Document:
    return reported.document


def section(document: Document, key: str) -> Section:
    (found,) = [each for each in document.sections if each.key == key]
    return found


def tables(document: Document, key: str) -> list[Table]:
    return [part for part in section(document, key).parts if isinstance(part, Table)]


def pictures(document: Document, key: str) -> list[Picture]:
    return [part for part in section(document, key).parts if isinstance(part, Picture)]


def test_sections_are_those_that_the_file_has_and_one_line_says_what_it_lacks(document: Document) -> None:
    keys = [each.key for each in document.sections]
    assert keys == ["results", "spectra", "map", "histories", "specimen", "modes", "limits", "provenance"]
    assert document.summary[-1] == "The file contains no earthquake test."
    assert "20 rad/s" in str(document.summary[0])
    assert "simulated" in str(document.summary[1])
    assert "1 point was tested" in str(section(document, "results").parts[0])


def test_the_results_are_those_of_the_summary_with_their_uncertainties(document: Document, file: Path) -> None:
    (point,) = json.loads((file.parent / "summary.json").read_text(encoding="utf-8"))["points"]
    gains, conditions, budget, sources = tables(document, "results")
    row = dict(zip([column.title for column in gains.columns], gains.rows[0], strict=True))
    value, uncertainty = (float(part) for part in row["α₂ measured"].split(" ± "))
    assert value == pytest.approx(point["alpha_2"], abs=0.001)
    assert uncertainty == pytest.approx(point["alpha_2_uncertainty"], rel=0.05)
    predicted_value, open_ = (float(part) for part in row["α₂ predicted"].split(" ± "))
    assert predicted_value == pytest.approx(point["alpha_2_predicted"], abs=open_ / 10.0)
    assert row["agrees"] == "yes"
    row = dict(zip([column.title for column in conditions.columns], conditions.rows[0], strict=True))
    assert float(row["peak drift, coupled"]) == pytest.approx(1e3 * point["drift_peak_m"], rel=1e-3)
    parts = json.loads(point["uncertainty_parts"])
    assert [column.title for column in budget.columns][2:] == list(parts)
    shown = [float(cell) for cell in budget.rows[0][1:]]
    assert shown[0] == pytest.approx(2.0 * np.hypot.reduce(shown[1:]), abs=0.006)
    assert shown[1:] == pytest.approx([100.0 * value / point["alpha_2"] for value in parts.values()], abs=6e-4)
    # each contribution with its type and remedy; those of the lasers with the correlation of their errors in both tests
    assert [row[0] for row in sources.rows] == list(parts)
    assert {row[1] for row in sources.rows} == {"A", "B"}
    correlations = json.loads(point["uncertainty_correlations"])
    assert {row[0]: row[4] for row in sources.rows if row[4] != "–"} == {
        name: f"{value:.2f}".replace("-", "−") for name, value in correlations.items()
    }
    (improvement,) = (part for part in section(document, "results").parts if "largest contribution" in str(part))
    assert point["dominating"] in str(improvement)


def test_the_drawn_cycles_are_the_measured_ones_in_the_phase_of_the_model(file: Path) -> None:
    with open_datafile(file) as record:
        campaign = Campaign(file, record)
        (point,) = campaign.harmonic_points
        assert campaign.configuration is not None
        signals = SignalMap(record.channels, campaign.configuration.laser_reference)
        amplitudes = point["amplitude_m_s2"], point["bare_amplitude_m_s2"]
        branch = predict_gain(campaign.specimen.coupled(0.25), 20.0, *amplitudes).rocking
        motion = Dwells(campaign, signals).motion(point, branch)
    assert motion is not None
    assert motion.predicted is not None
    assert motion.bare_drift is not None
    assert motion.time.shape == motion.drift.shape == (PERIODS * SAMPLES,)
    # the peak of single cycles against that of the fit of all: what the noise of 50 um steps leaves
    assert np.nanmax(np.abs(motion.drift)) == pytest.approx(point["drift_peak_m"], abs=1.5e-4)
    assert np.nanmax(np.abs(motion.bare_drift)) == pytest.approx(point["bare_drift_peak_m"], abs=1.5e-4)
    # drift and u1 lie on the prediction, which they could not if the phase were that of another instant
    assert np.sqrt(np.nanmean((motion.drift - motion.predicted.drift) ** 2)) < 0.05 * point["drift_peak_m"]
    assert np.sqrt(np.nanmean((motion.u1 - motion.predicted.u1) ** 2)) < 0.1 * np.abs(motion.predicted.u1).max()


def test_the_figures_have_axes_with_units_and_the_map_has_the_point(document: Document) -> None:
    (spectra,), (gain_map,), (histories,) = (pictures(document, key) for key in ("spectra", "map", "histories"))
    labels = {panel.get_xlabel() for panel in (*spectra.figure.axes, *gain_map.figure.axes)}
    assert labels == {r"$\Omega$  [rad/s]"}
    annotations = {text.get_text() for panel in gain_map.figure.axes for text in panel.texts}
    assert "1.35" in annotations
    words = [text.get_text() for legend in histories.figure.legends for text in legend.get_texts()]
    assert r"$\vartheta$, predicted only, right axis" in words
    assert {panel.get_ylabel().split()[-1] for panel in histories.figure.axes} == {"[mm]", "[mrad]"}


def test_limits_and_provenance_name_file_hash_versions_and_seed(document: Document, file: Path) -> None:
    from hashlib import sha256

    facts = {row[0]: row[1] for table in tables(document, "provenance") for row in table.rows}
    assert facts["SHA-256 of the file"] == sha256(file.read_bytes()).hexdigest()
    assert facts["seed of the simulation"] == "7"
    assert "numba" in facts["libraries when recorded"]
    rows = {row[1]: row for row in tables(document, "provenance")[1].rows}
    assert rows["--omega"][2:] == ["20", "rad/s"]
    assert rows["--settle-limit"][2:] == ["240", "s"]
    captions = [table.caption for table in tables(document, "limits")]
    assert any("preflight" in caption for caption in captions)
    assert any("guard" in caption for caption in captions)


def test_the_command_overwrites_only_when_asked(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    html, pdf = tmp_path / "a.html", tmp_path / "a.pdf"
    html.write_text("precious", encoding="utf-8")
    assert main(["report", str(file), "--html", str(html), "--pdf", str(pdf)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert html.read_text(encoding="utf-8") == "precious"
    assert not pdf.exists()


def test_the_command_never_overwrites_the_data(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = file.read_bytes()
    other = file.parent / ".." / file.parent.name / file.name
    assert main(["report", str(file), "--html", str(other), "--overwrite"]) == 2
    assert "it is the data file itself" in capsys.readouterr().err
    assert file.read_bytes() == before


def test_the_command_writes_both_forms(reported: Reported) -> None:
    text = reported.html.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert text.count("<svg ") == 5
    # what a person noted is text, in the summary and in the provenance
    assert "<script>" not in text
    assert "<b>Ann" not in text
    assert text.count("&lt;script&gt;alert(1)&lt;/script&gt; 5 % &amp; #[x]") == 2
    # five figures and a dozen tables
    with PdfDocument(reported.pdf) as printed:
        assert len(printed) >= 5
        whole = "".join(page.get_textpage().get_text_range() for page in printed)
        assert "".join(whole.split()).count("".join(NOTE.split())) == 2
    assert [path.name for path in sorted(reported.html.parent.iterdir())] == ["a.html", "a.pdf"]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.h5", None, "there is no such file"),
        ("text.h5", b"no HDF5 at all", "not an HDF5 file"),
    ],
)
def test_files_that_are_no_records_are_refused(
    name: str, content: bytes | None, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert main(["report", str(tmp_path / name), "--html", str(tmp_path / "r.html")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "r.html").exists()
