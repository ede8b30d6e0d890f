"""Free rocking end to end on a virtual bench whose restitution is known, and how it ends otherwise."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.app.preflight import compile_run
from bench.app.session import SessionResult, run_session
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_specimen
from bench.config.sections import Acquisition, Simulation
from bench.datafile.reader import open_datafile
from bench.document.campaign import Campaign
from bench.engine.interface import Requests, Unattended
from bench.events import Acquired, Event, OperatorAnswered, OperatorAsked, PointFinished, Warned
from bench.findings import FitFinished
from bench.guard.limits import Limits
from bench.results import FILE
from protocols.free_rocking.plan import planned_tilts
from protocols.free_rocking.protocol import ALL, FreeRockingParameters, RockingPoint
from protocols.free_rocking.results import rocking_sections
from sim.errors import InvalidInput
from sim.filter_unit import FilterUnit
from sim.free_rocking import critical_angle
from sim.sensors import Laser
from sim.specimen import Block, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent

FACTOR = 0.985
PROTOCOL = load_protocol("free-rocking")
SHORT = FreeRockingParameters(tilts=(0.5,), attempts=2)
# the rocking block moves by 36 mm: no drift, and not to be taken for one
LIMITS = Limits(drift=0.02)


def bench(factor: float = FACTOR, limits: Limits = LIMITS, **changes: object) -> BenchConfiguration:
    simulated = VirtualBenchParameters(laser_2=Laser(scale_error=0.002), **changes)  # type: ignore[arg-type]
    true = Specimen(block=Block(restitution_factor=factor))
    simulation = Simulation(bench=simulated, specimen=true)
    return BenchConfiguration(acquisition=Acquisition(block_duration=0.2), simulation=simulation, limits=limits)


class Declining(Unattended):
    """Declines the second tilt."""

    def confirm(self, request: str) -> bool:
        return not request.startswith("Tilt 2")


def run(
    configuration: BenchConfiguration, out: Path, operator: Unattended | None = None, *, figures: bool = False
) -> tuple[SessionResult, list[Event]]:
    events: list[Event] = []
    result = run_session(
        PROTOCOL if figures else replace(PROTOCOL, figures=()),
        PROTOCOL.prepare(SHORT, configuration, None),
        out=out,
        operator=operator or Unattended(),
        subscribers=[events.append],
        requests=Requests(),
        realtime=False,
    )
    return result, events


Session = tuple[Path, SessionResult, list[Event]]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    out = tmp_path_factory.mktemp("free_rocking") / "run"
    return out, *run(bench(), out, figures=True)


def test_the_restitution_is_found_within_its_uncertainty(session: Session) -> None:
    _, result, events = session
    assert (result.status, result.reason) == ("completed", "the plan was carried out")
    rows = [event.point for event in events if isinstance(event, PointFinished)]
    *tilts, combined = (row for row in rows if isinstance(row, RockingPoint))
    assert [row.part for row in (*tilts, combined)] == ["tilt 1", "tilt 2", ALL]
    for row in (*tilts, combined):
        # three standard uncertainties
        assert abs(row.ratio - FACTOR) < 1.5 * row.ratio_uncertainty < 2e-4
        assert abs(row.r_amplitudes / row.r_th - FACTOR) < 1.5 * row.r_amplitudes_uncertainty < 1e-3
        assert abs(row.alpha_rad - row.alpha_sides_rad) < 1.5 * row.alpha_uncertainty_rad
        assert abs(row.p_rad_s - row.p_sides_rad_s) < 1.5 * row.p_uncertainty_rad_s
        assert abs(row.trend) < 1.5 * row.trend_uncertainty
    assert combined.impacts == sum(row.impacts for row in tilts) > 40
    assert [np.sign(row.tilt_rad or 0.0) for row in tilts] == [1.0, -1.0]
    assert not any(isinstance(event, Warned) for event in events)
    ends_at_100_percent(events)


def test_nothing_is_driven_and_the_bench_is_left_as_it_was(session: Session) -> None:
    _, result, events = session
    assert not any(event.drive.any() for event in events if isinstance(event, Acquired))
    asked = [event.request for event in events if isinstance(event, OperatorAsked)]
    assert asked == [event.request for event in events if isinstance(event, OperatorAnswered)]
    assert any("square to it, 300 mm above the table" in request for request in asked)
    assert ["Clamp the table" in asked[0], "19 mm" in asked[2], "away from" in asked[3]] == [True] * 3
    assert asked[-2:] == ["Aim laser 2 at storey 2 again.", "Remove the clamps from the table."]
    assert "LOCKED" not in result.table


def test_the_files_say_what_was_found(session: Session) -> None:
    out, result, events = session
    combined = next(row for row in result.summary["points"] if row["part"] == ALL)  # type: ignore[union-attr]
    (finding,) = read_specimen(out / "specimen.json").findings
    assert finding.name == "restitution_factor"
    assert (finding.value, 2.0 * finding.standard_uncertainty) == pytest.approx(
        (combined["ratio"], combined["ratio_uncertainty"]), rel=1e-12
    )
    with open_datafile(out / FILE) as record:
        assert record.points == json.loads((out / "summary.json").read_text(encoding="utf-8"))["points"]
        fits = {fit.name: fit for fit in record.fits}
        assert len(record.tables["prediction"]["impact"].values) > 40
        (section,) = rocking_sections(Campaign(out / FILE, record))
    kinds = [type(part).__name__ for part in section.parts]
    assert kinds == ["str", "Table", "Table", "str", "Table", "Table", "Picture", "Picture"]
    assert list(fits) == [event.name for event in events if isinstance(event, FitFinished)]
    motion, impacts = fits["tilt 1"], fits["impacts of tilt 1"]
    left = motion.columns["measured"].values - motion.columns["fitted"].values
    np.testing.assert_allclose(motion.columns["residual"].values, left)
    assert impacts.columns["restitution"].values.mean() == pytest.approx(combined["r_exp"], abs=1e-3)
    assert combined["ratio"] == pytest.approx(FACTOR, abs=combined["ratio_uncertainty"])
    assert f"r_exp / r_th = {combined['ratio']:.6f}" in result.table
    assert (out / "free_rocking.png").stat().st_size > 50_000


def test_what_was_found_is_in_the_data_file_and_is_made_again_by_an_analysis(
    session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _, _ = session
    kept = read_specimen(out / "specimen.json")
    with open_datafile(out / FILE) as record:
        assert record.identified == kept
        rows, fits = record.points, {fit.name: fit for fit in record.fits}
        parts = json.loads(rows[-1]["uncertainty_parts"])
        for part in ("tilt 1", "tilt 2"):
            row = next(row for row in rows if row["part"] == part)
            found = fits[part].parameters
            for name, doubt in (("restitution", "r_exp"), ("alpha", "alpha"), ("p", "p")):
                stated = next(row[key] for key in row if key.startswith(f"{doubt}_uncertainty"))
                assert 2.0 * found[name].uncertainty == pytest.approx(stated, rel=1e-9)
    assert np.linalg.norm(list(parts.values())) == pytest.approx(rows[-1]["r_exp_uncertainty"] / 2.0, rel=1e-3)
    # two of 3e-5 are the clock's alone
    assert rows[-1]["p_uncertainty_rad_s"] > 6e-5 * rows[-1]["p_rad_s"]
    (finding,) = kept.findings
    assert f"r_exp = {rows[-1]['r_exp']:.6f}" in finding.source
    assert re.search(r"of a block [\d.]+ m wide and [\d.]+ m high$", finding.source)
    again = tmp_path / "again.h5"
    assert main(["analyse", str(out / FILE), "--out", str(again)]) == 0
    assert "again.specimen.json" in capsys.readouterr().out
    (anew,) = read_specimen(tmp_path / "again.specimen.json").findings
    assert (anew.value, anew.standard_uncertainty) == (finding.value, finding.standard_uncertainty)


def test_a_block_that_hardly_rocks_is_told_and_the_table_unlocked(tmp_path: Path) -> None:
    result, events = run(bench(0.5), tmp_path / "run")
    assert (result.status, "no tilt was usable" in result.reason) == ("failed", True)
    told = [event.text for event in events if isinstance(event, Warned)]
    assert len(told) == 2 * SHORT.attempts
    assert all("sufficiently large impacts" in text for text in told)
    asked = [event.request for event in events if isinstance(event, OperatorAsked)]
    assert asked[-1] == "Remove the clamps from the table."
    assert any(text.startswith("The last recording was not usable.") for text in asked)
    assert not (tmp_path / "run" / "specimen.json").exists()
    assert "No tilt was usable" in result.table


def test_a_run_that_is_declined_says_what_is_left_to_undo(tmp_path: Path) -> None:
    result, _ = run(bench(), tmp_path / "run", Declining())
    assert result.status == "aborted"
    assert "THE TABLE IS STILL LOCKED" in result.table
    assert "Laser 2 still points at the block" in result.table


def test_preflight_says_that_nothing_is_driven(tmp_path: Path) -> None:
    prepared = PROTOCOL.prepare(SHORT, bench(), None)
    margins = {each.bound.quantity: each for each in compile_run("free-rocking", prepared, tmp_path).margins}
    assert (margins["drive_voltage"].demand.value, margins["displacement"].demand.value) == (0.0, 0.0)
    assert margins["drift"].margin is None
    alpha = critical_angle(Block())
    assert margins["laser_2"].demand.value == pytest.approx(0.3 * np.tan(0.5 * alpha) / 0.1, rel=1e-9)


def test_the_tilts_go_to_both_sides_smallest_first() -> None:
    alpha = critical_angle(Block())
    asked = FreeRockingParameters(tilts=(0.6, 0.3))
    tilts = planned_tilts(asked, Specimen())
    assert [tilt.angle for tilt in tilts] == pytest.approx([0.3 * alpha, -0.3 * alpha, 0.6 * alpha, -0.6 * alpha])
    assert tilts[2].displacement == pytest.approx(0.3 * np.tan(0.6 * alpha))
    away = asked.model_copy(update={"sides": "away"})
    assert [tilt.angle for tilt in planned_tilts(away, Specimen())] == pytest.approx([-0.3 * alpha, -0.6 * alpha])


@pytest.mark.parametrize(
    ("asked", "configuration", "says"),
    [
        ({"tilts": (0.95,)}, bench(), "tilts"),
        ({"tilts": (0.5, 0.5)}, bench(), "once"),
        ({"height": 0.399}, bench(), "misses the face .* between 0.0.* and 0.39.* m for these tilts"),
        ({"height": 1e-4}, bench(), "misses the face .* between 0.0"),
        ({"tilts": (0.8,)}, bench(limits=Limits(laser_range=0.2)), "aim lower"),
        ({}, bench(filter_unit=FilterUnit(cutoff=30.0)), "filter_unit.cutoff"),
    ],
)
def test_what_cannot_be_watched_is_refused(
    asked: dict[str, object], configuration: BenchConfiguration, says: str
) -> None:
    with pytest.raises((InvalidInput, ValueError), match=says):
        PROTOCOL.prepare(FreeRockingParameters(**asked), configuration, None)  # type: ignore[arg-type]
