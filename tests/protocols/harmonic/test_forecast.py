"""The forecast of a harmonic campaign: against closed forms and against the lab sheet; `test_point` has a run."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest

from bench.app.cli.main import main
from bench.app.preflight import Preflight, compile_run
from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment, program
from bench.engine.steps import Dwell, Sweep
from bench.preflight.demands import response_of, stage_travels
from bench.preflight.margins import Demand
from protocols.common.sine.demands import Trial
from protocols.harmonic import campaign
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.forecast import trials
from protocols.harmonic.protocol import HarmonicParameters
from sim.gain import predict_gain
from sim.linear import steady_response
from sim.specimen import Specimen
from tests.protocols.harmonic.scripted import AMPLITUDE, BETA, OMEGA, PARAMETERS, Script

pytestmark = pytest.mark.usefixtures("shared_results")

CONFIGURATION = BenchConfiguration()
SHORT = HarmonicParameters(omega=(OMEGA,), beta=(BETA,))


def _compiled(parameters: HarmonicParameters = SHORT, configuration: BenchConfiguration = CONFIGURATION) -> Preflight:
    return compile_run("harmonic", HarmonicCampaign(parameters, configuration), Path())


def _by_quantity(found: Preflight) -> dict[str, Demand]:
    return {each.bound.quantity: each.demand for each in found.margins}


def _trials(parameters: HarmonicParameters) -> list[Trial]:
    starts = HarmonicCampaign(parameters, CONFIGURATION).starts
    return list(trials(parameters, CONFIGURATION, response_of(CONFIGURATION), starts))


def test_the_bare_frame_moves_as_its_linear_response_says() -> None:
    """At 20 rad/s, above both modes, the ramp is soft: the peaks are those of the steady state."""
    omega = 20.0
    bare = next(trial for trial in _trials(HarmonicParameters(omega=(omega,), beta=(BETA,))) if trial.steady)
    (moved,) = stage_travels([bare.specimen], [program(bare.segments)], bare.begin, "ground", 0.35)
    u1, u2 = steady_response(Specimen(), omega, AMPLITUDE)
    table = -AMPLITUDE / omega**2
    seen = (abs(u1 + table), abs(u2 + table), abs(u2 - u1))
    assert (moved.storey_1, moved.storey_2, moved.drift) == pytest.approx(seen, rel=0.05)


@pytest.mark.parametrize("reference", ["ground", "table"])
def test_specimens_simulated_together_move_as_each_alone(reference: Literal["ground", "table"]) -> None:
    """They share the times and the phase of the table, bit for bit."""
    coupled = Specimen().coupled(BETA)
    segments = (Segment(2.0, 0.9 * AMPLITUDE, 25.0), Segment(3.0, 1.3 * AMPLITUDE, 12.0), Segment(1.0, AMPLITUDE, 12.0))
    programs = [
        program([replace(segment, amplitude=k * segment.amplitude) for segment in segments])
        for k in (1.0, 0.97, 1.03, 3.0)
    ]
    together = stage_travels([coupled] * 4, programs, 0.5, reference, 0.35)
    alone = [stage_travels([coupled], [each], 0.5, reference, 0.35)[0] for each in programs]
    assert together == alone
    assert len({each.drift for each in together}) == 4


def test_the_demands_of_the_table_are_those_of_its_largest_sine() -> None:
    found = _by_quantity(_compiled())
    # 1.2 x the amplitude at the asked frequency, and what friction and noise leave open
    peak = 1.2 * AMPLITUDE
    assert found["displacement"].value == pytest.approx(1.03 * peak / OMEGA**2, rel=1e-3)
    assert found["velocity"].value == pytest.approx(1.03 * peak / OMEGA, rel=1e-3)
    for demand in found.values():
        assert demand.value is not None
        assert demand.likely is not None
        assert demand.likely >= demand.value


def test_the_lab_sheet_drives_what_was_predicted() -> None:
    """Legs of calibrations and starts, as the plan asks for them, beside those of the forecast."""
    found = predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE)
    assert found.rocking is not None
    script = Script(lambda *_: None, found.bare.drift)
    script.run()
    followed = [segment for step in script.steps if isinstance(step, Sweep) for segment in step.segments]
    forecast = _trials(PARAMETERS)
    starts = [trial.stage for trial in forecast if trial.beta is not None]
    assert len(starts) == PARAMETERS.starts
    assert [segment for stage in starts for segment in stage.segments] == followed[
        -sum(len(stage.segments) for stage in starts) :
    ]
    (spring,) = [trial.stage for trial in forecast if "beta" in trial.stage.name and trial.beta is None]
    first = followed.index(spring.segments[0], 3)
    driven = followed[first : first + len(spring.segments) // 2 + 1]
    # each frequency is gone to, then held: the plan asks for the latter as a dwell
    assert [(segment.amplitude, segment.omega) for segment in driven] == [
        (segment.amplitude, segment.omega) for segment in (*spring.segments[:-1:2], spring.segments[-1])
    ]
    assert all(step.cycles == 6 for step in script.steps if isinstance(step, Dwell) and step.cycles < 12)


def test_starts_are_planned_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[float] = []
    plan = campaign.plan_starts
    monkeypatch.setattr(campaign, "plan_starts", lambda *arguments: calls.append(arguments[1]) or plan(*arguments))
    prepared = HarmonicCampaign(PARAMETERS, CONFIGURATION)
    assert sum(stage.chance is not None for stage in prepared.forecast.stages) == PARAMETERS.starts
    bare = predict_gain(Specimen().coupled(BETA), OMEGA, AMPLITUDE).bare.drift
    Script(lambda *_: None, bare, prepared).run()
    assert calls == [OMEGA]


def test_a_specimen_that_is_known_worse_has_smaller_margins_and_other_chances() -> None:
    wide = CONFIGURATION.model_copy(
        update={"uncertainty": CONFIGURATION.uncertainty.model_copy(update={"stiffness": 0.2, "damping": 0.6})}
    )
    usual, doubtful = _by_quantity(_compiled(PARAMETERS)), _by_quantity(_compiled(PARAMETERS, wide))
    assert usual["drift"].likely is not None
    assert doubtful["drift"].likely is not None
    assert doubtful["drift"].likely > usual["drift"].likely
    assert _compiled(PARAMETERS).plan_hash != _compiled(PARAMETERS, wide).plan_hash


def test_the_same_campaign_has_the_same_hash() -> None:
    assert _compiled(PARAMETERS).plan_hash == _compiled(PARAMETERS).plan_hash


def test_on_an_unknown_table_the_drive_is_not_predicted_and_says_why() -> None:
    found = _by_quantity(_compiled(PARAMETERS, BenchConfiguration(backend="hardware")))
    for quantity in ("drive_voltage", "drive_slew", "force", "current", "heating"):
        assert found[quantity].value is None
        assert "unknown" in found[quantity].where
    assert found["drift"].value is not None


def test_a_campaign_beyond_a_limit_is_refused_before_anything_is_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What only the simulated starts and calibrations show: the closed forms of the table allow it."""
    (tmp_path / "bench.toml").write_text("[limits]\nacceleration = 1.6\n", encoding="utf-8")
    command = ["run", "harmonic", "--omega", "16", "--beta", "0.4", "--config", str(tmp_path / "bench.toml")]
    out = tmp_path / "run"
    assert main([*command, "--yes", "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "limits.acceleration = 1.6 is refused: start 1 of beta = 0.4 at omega = 16 rad/s" in shown.err
    assert main([*command, "--dry-run", "--json", "--out", str(out)]) == 2
    content = json.loads(capsys.readouterr().out)
    assert content["would_run"] is False
    assert content["margins"][0]["quantity"] == "acceleration"
    assert content["margins"][0]["margin"] < 0.0
    assert not out.exists()


def test_a_dry_run_tells_everything_and_creates_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def opened(*_: object, **__: object) -> None:
        raise AssertionError("a rig was opened")

    monkeypatch.setattr("bench.app.session.open_rig", opened)
    monkeypatch.chdir(tmp_path)
    command = ["run", "harmonic", "--omega", "16", "--beta", "0.4", "--dry-run"]
    assert main(command) == 0
    text = capsys.readouterr().out
    assert main([*command, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert list(tmp_path.iterdir()) == []
    assert content["would_run"] is True
    assert content["refused"] is None
    margins = [each["margin"] for each in content["margins"]]
    assert margins == sorted(margins)
    assert len(content["starts"]) == 6
    assert content["duration_s"] > 60.0
    assert content["disk"]["needed_bytes"] > 1e6
    for words in (content["plan_hash"], "Tightest margin: drift, limited by limits.drift", "table displacement", "97%"):
        assert words in text
