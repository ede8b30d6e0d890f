"""The specimen file: written, read, refused, and what a configuration makes of it."""

import errno
import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bench.app.cli.inputs import configuration_from
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_specimen, write_specimen
from bench.config.template import as_toml
from bench.config.toml import problems_of, read_configuration
from sim.errors import InvalidInput, RockbenchError
from sim.identified import Correlation, Finding, Identified
from sim.specimen import Specimen

DATE = datetime(2026, 11, 20, 9, 30, tzinfo=UTC)

IDENTIFIED = Identified(
    findings=(
        Finding(name="k1", value=210.0, standard_uncertainty=0.5, source="decay, 5 pulls", date=DATE),
        Finding(name="restitution_factor", value=0.992, standard_uncertainty=1e-3, source="free rocking", date=DATE),
        Finding(name="k_c:0.25", value=52.0, standard_uncertainty=0.3, source="block held", date=DATE),
    ),
    correlations=(Correlation(first="k1", second="k_c:0.25", coefficient=-0.5),),
)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "specimen.json"
    write_specimen(path, IDENTIFIED)
    return path


def test_a_file_reads_back_as_it_was_written_and_says_its_units(kept: Path) -> None:
    assert read_specimen(kept) == IDENTIFIED
    content = json.loads(kept.read_text(encoding="utf-8"))
    assert (content["format"], content["format_version"]) == ("rocking-bench specimen", 1)
    assert [finding["unit"] for finding in content["findings"]] == ["N/m", "1", "N/m"]


def test_a_file_is_never_overwritten(kept: Path) -> None:
    before = kept.read_bytes()
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_specimen(kept, Identified())
    assert kept.read_bytes() == before
    with pytest.raises(InvalidInput, match="the folder does not exist"):
        write_specimen(kept / "inside.json", Identified())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:-20], "cannot be read as JSON"),
        (lambda _: "[1, 2]", "it is not a specimen file"),
        (lambda text: text.replace("rocking-bench specimen", "table model"), "it is not a specimen file"),
        (lambda text: text.replace('"format_version": 1', '"format_version": 2'), "the file has 2: update this"),
        (lambda text: text.replace('"software"', '"colour"'), "colour = .* there is no such key"),
        (lambda text: text.replace('"k1"', '"k3"'), r"findings\[0\].name = 'k3' .* no such quantity"),
        (lambda text: text.replace('"N/m"', '"kN/m"', 1), r"findings\[0\].unit = 'kN/m' .* k1 is \"N/m\""),
        (lambda text: text.replace('"unit": "1",', ""), r"findings\[1\].unit = None .* convert"),
        (lambda text: text.replace("210.0", "-210.0"), r"findings\[0\].value = -210"),
        (lambda text: text.replace("210.0", "NaN"), r"findings\[0\].value"),
        (lambda text: text.replace('"k1"', '"k2"', 1), "correlations = 'k1' .* no such finding"),
        (lambda text: text.replace('"date"', '"data"', 1), r"findings\[0\].date = None .* it is required"),
        (
            lambda text: text.replace("09:30:00Z", "09:30:00", 1),
            r"findings\[0\].date .* ISO 8601 time with a time zone, such",
        ),
        (
            lambda text: text.replace('"2026-11-20T09:30:00Z"', '"today"', 1),
            r"findings\[0\].date = 'today' .* ISO 8601",
        ),
        (
            lambda text: text.replace('"k1"', '"k_c:0.2500000001"'),
            "k_c:0.2500000001' .* label cannot be distinguished from that of k_c:0.25",
        ),
        (lambda text: text.replace('"value": 210.0', '"value": 0.0'), r"findings\[0\].value .* k1 must be above 0"),
        (lambda text: text.replace('"findings": [', '"findings": [3, '), r"findings\[0\]"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_place(kept: Path, change: Callable[[str], str], said: str) -> None:
    kept.write_text(change(kept.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InvalidInput, match=said) as caught:
        read_specimen(kept)
    assert "specimen.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_absent_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no such file"):
        read_specimen(tmp_path / "specimen.json")


def test_a_configuration_takes_it_in_and_keeps_it_in_every_form(kept: Path) -> None:
    bench = kept.parent / "bench.toml"
    bench.write_text('specimen_file = "specimen.json"\n[specimen.frame]\nk2 = 57.0\n', encoding="utf-8")
    configuration = read_configuration(bench)
    assert (configuration.identified, configuration.specimen_file) == (IDENTIFIED, None)
    assert BenchConfiguration.model_validate_json(configuration.model_dump_json()) == configuration
    other = kept.parent / "again.toml"
    other.write_text(as_toml(configuration), encoding="utf-8")
    assert read_configuration(other) == configuration


def test_what_is_identified_is_predicted_with_and_what_is_assumed_stays_beside_it(kept: Path) -> None:
    configuration = configuration_from(None, None, kept)
    best = configuration.known_specimen
    assert (best.frame.k1, best.block.restitution_factor) == (210.0, 0.992)
    assert best.coupled(0.25).k_c == pytest.approx(52.0)
    assert configuration.specimen == Specimen()
    # the bench is simulated as assumed: what was found out about it does not change it
    assert configuration.simulation.specimen is None
    assert configuration.known.relative(best.coupled(0.25))["k1"] == pytest.approx(0.5 / 210.0)


def test_a_file_that_cannot_be_used_is_found_by_the_check_of_a_configuration(kept: Path) -> None:
    bench = kept.parent / "bench.toml"
    bench.write_text('specimen_file = "elsewhere.json"\n', encoding="utf-8")
    (problem,) = problems_of(bench)
    assert "there is no such file" in str(problem)
    bench.write_text('specimen_file = "specimen.json"\n[identified]\nfindings = []\n', encoding="utf-8")
    (problem,) = problems_of(bench)
    assert "identified is also present" in str(problem)
    kept.write_text(kept.read_text(encoding="utf-8").replace("0.992", "1.2"), encoding="utf-8")
    bench.write_text('specimen_file = "specimen.json"\n', encoding="utf-8")
    (problem,) = problems_of(bench)
    assert "these values do not form a valid specimen" in str(problem)


def test_findings_may_stand_in_the_configuration_and_are_judged_there(tmp_path: Path) -> None:
    bench = tmp_path / "bench.toml"
    text = as_toml(BenchConfiguration(identified=IDENTIFIED))
    bench.write_text(text.replace("value = 210.0", "value = -1.0"), encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"bench.toml: identified.findings\[0\].value = -1.0 .* at least 0"):
        read_configuration(bench)


def test_predictions_take_it_and_flags_win_over_it(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def predicted(*flags: str) -> dict[str, object]:
        assert main(["predict", "steady", "--omega", "20", "--beta", "0.25", "--json", *flags]) == 0
        return json.loads(capsys.readouterr().out)

    found = predicted("--specimen", str(kept))
    assert found["specimen"]["frame"]["k1"] == 210.0
    rocking, assumed = found["points"][0], predicted()["points"][0]
    assert (rocking["layer"], rocking["beta"]) == ("rocking", 0.25)
    # of the assumed specimen less is known
    assert 0.0 < rocking["alpha_2_uncertainty"] < assumed["alpha_2_uncertainty"]
    assert rocking["alpha_2_low"] < rocking["alpha_2"] < rocking["alpha_2_high"]
    other = predicted("--specimen", str(kept), "--restitution-factor", "0.98")
    assert other["specimen"]["block"]["restitution_factor"] == 0.98
    assert [finding["name"] for finding in other["known"]["identified"]["findings"]] == ["k1", "k_c:0.25"]


def test_a_file_on_a_full_disk_is_no_file_and_no_refusal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(RockbenchError, match=r"could not be written \(No space left on device\): check") as caught:
        write_specimen(tmp_path / "specimen.json", IDENTIFIED)
    assert not isinstance(caught.value, InvalidInput)
    assert list(tmp_path.iterdir()) == []
