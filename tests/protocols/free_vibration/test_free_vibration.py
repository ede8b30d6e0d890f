"""Free vibration and springs end to end, on virtual benches that are not as they are assumed to be."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydantic import ValidationError

from bench.analysis.free_decay.decay import Combined
from bench.analysis.free_decay.stretch import Unusable
from bench.analysis.uncertainty import in_brackets, plus_minus
from bench.app.catalogue import load_protocol
from bench.app.preflight import compile_run
from bench.app.session import SessionResult
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_specimen
from bench.config.sections import Acquisition, Simulation
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from bench.document.campaign import Campaign
from bench.document.document import Picture, Table
from bench.engine.steps import Arm, Done, OperatorAction, Plan
from bench.events import Event, OperatorAsked, StepStarted, Warned
from bench.findings import FitFinished
from bench.guard.limits import Limits
from bench.protocol import Prepared, Protocol
from bench.results import FILE
from protocols.common.calibrate import Unmeasurable
from protocols.common.decays.frame import FrameResult, nonlinear_text
from protocols.common.decays.pulse import SHARE, plan_pulse
from protocols.coupling_stiffness.protocol import CouplingStiffnessParameters
from protocols.coupling_stiffness.results import springs_sections
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.free_vibration.report import vibration_sections
from sim.errors import InvalidInput
from sim.identified import Correlation, Finding, Identified
from sim.parameters import Parameters
from sim.sensors import Laser
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent, followed

TRUE = Frame(k1=1.04 * 213.44, k2=0.96 * 56.45, xi1=0.013, xi2=0.028)
SPRING = 1.08
FURTHEST = 4.0
"""Standard uncertainties that an identified value may be off in a test: one in 16 000 is farther."""


def bench(**changes: object) -> BenchConfiguration:
    lasers = {"laser_1": Laser(scale_error=0.002), "laser_2": Laser(scale_error=-0.002)}
    simulated = VirtualBenchParameters(sample_rate=1000.0, **lasers)  # type: ignore[arg-type]
    simulation = Simulation(bench=simulated, specimen=Specimen(frame=TRUE), spring_factor=SPRING, seed=3)
    return BenchConfiguration(acquisition=Acquisition(block_duration=0.2), simulation=simulation, **changes)  # type: ignore[arg-type]


FRAME, SPRINGS = load_protocol("free-vibration"), load_protocol("coupling-stiffness")


def prepared(parameters: Parameters, configuration: BenchConfiguration) -> Prepared[Any]:
    """By the protocol whose parameters they are."""
    protocol: Protocol[Any] = FRAME if isinstance(parameters, FreeVibrationParameters) else SPRINGS
    return protocol.prepare(parameters, configuration, None)


def run(
    parameters: Parameters, configuration: BenchConfiguration, out: Path, *, figures: bool = False
) -> tuple[SessionResult, list[Event]]:
    protocol = FRAME if isinstance(parameters, FreeVibrationParameters) else SPRINGS
    return followed(protocol, prepared(parameters, configuration), out, figures=figures)


def close(finding: Finding | None, truth: float) -> bool:
    assert finding is not None
    return abs(finding.value - truth) < FURTHEST * finding.standard_uncertainty


def test_pulses_tell_the_frame_and_everything_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "run"
    parameters = FreeVibrationParameters(repeats=2, window=10.0)
    result, events = run(parameters, bench(), out, figures=True)
    assert (result.status, result.reason) == ("completed", "the plan was carried out")
    found = read_specimen(out / "specimen.json")
    assert found.names == ("k1", "k2", "xi1", "xi2", "m1", "m2")
    assert all(close(found.finding(name), getattr(TRUE, name)) for name in found.names)
    k1 = found.finding("k1")
    # half a gram of each storey, and little else
    assert k1 is not None
    assert 0.5e-3 < k1.standard_uncertainty / k1.value < 1.0e-3
    assert found.correlation(("k1", "m1"))[0, 1] > 0.3
    steps = [event.text for event in events if isinstance(event, StepStarted)]
    assert steps[:2] == ["free vibration: 30 mm of drift, as requested", "probe 1: a pulse of 0.02 V"]
    fits = [event for event in events if isinstance(event, FitFinished)]
    with open_datafile(out / FILE) as record:
        assert [fit.name for fit in record.fits] == ["free vibration 1", "free vibration 2"]
        np.testing.assert_array_equal(record.fits[0].columns["laser_1"].values, fits[0].columns["laser_1"].values)
        assert [point["decay"] for point in record.points] == [1, 2, 0]
        together = record.points[-1]
        assert together["k1_n_m"] == k1.value
        assert 0.024 < together["drift_peak_m"] < 0.036
        assert together["birge"] is not None
        (section,) = vibration_sections(Campaign(out / FILE, record))
        frame, budget, sources, damping = (part for part in section.parts if isinstance(part, Table))
        assert "–" not in [row[1] for row in sources.rows]
        assert [row[0] for row in budget.rows] == ["k₁", "k₂", "ξ₁", "ξ₂"]
        assert len([part for part in section.parts if isinstance(part, Picture)]) == 2
        parts = json.loads(together["k1_parts"])
        assert np.linalg.norm(list(parts.values())) == pytest.approx(0.5 * together["k1_uncertainty"], rel=1e-3)
        assert next(iter(parts)) == "masses"
        assert [row[0] for row in frame.rows] == [row[0] for row in damping.rows] == ["1", "2", "all"]
        assert frame.rows[-1][1].startswith(f"{k1.value:.2f} ± {2.0 * k1.standard_uncertainty:.2f}")
    assert verify(out / FILE).problems == ()
    assert (out / "free_vibration.png").stat().st_size > 50_000
    assert "all" in result.table.splitlines()[5]
    ends_at_100_percent(events)


def test_the_spring_is_the_difference_that_it_makes(tmp_path: Path) -> None:
    out = tmp_path / "run"
    parameters = CouplingStiffnessParameters(beta=(0.25, 0.97), repeats=1, window=10.0)
    result, events = run(parameters, bench(), out, figures=True)
    assert result.status == "completed"
    ends_at_100_percent(events)
    found = read_specimen(out / "specimen.json")
    for label in (0.25, 0.97):
        truth = SPRING * label * 213.44
        finding = found.finding(f"k_c:{label}")
        assert finding is not None
        assert close(finding, truth)
        # what both frames have in common cancels: better than the bare frame's own 0.08 % would allow
        assert finding.standard_uncertainty / truth < 0.0012
    with open_datafile(out / FILE) as record:
        springs = [point for point in record.points if point["beta"] is not None and point["decay"] == 0]
        for point in springs:
            off = point["beta_mounted"] - point["beta"] * SPRING * 213.44 / TRUE.k1
            assert abs(off) < 0.5 * FURTHEST * point["beta_uncertainty"]
            assert point["k2_agrees"] is True
        (section,) = springs_sections(Campaign(out / FILE, record))
        springs_table, budget, _ = (part for part in section.parts if isinstance(part, Table))
        assert [row[0] for row in springs_table.rows][::2] == ["bare frame", "0.25", "0.97"]
        assert [row[0] for row in budget.rows] == ["β = 0.25", "β = 0.97"]
        assert len([part for part in section.parts if isinstance(part, Picture)]) == 2
    assert (out / "coupling_stiffness.png").stat().st_size > 50_000
    assert len(result.table.splitlines()) == 8


def before(name: str, value: float, size: float) -> Finding:
    return Finding(
        name=name,
        value=value,
        standard_uncertainty=size,
        source="before",
        date="2026-11-20T10:00:00Z",  # type: ignore[arg-type]
    )


KNOWN = Identified(
    findings=(before("k1", TRUE.k1 + 0.1, 0.16), before("k2", TRUE.k2, 0.04)),
    correlations=(Correlation(first="k1", second="k2", coefficient=-0.5),),
)
KNOWN_REFERENCE = CouplingStiffnessParameters(beta=(0.64,), repeats=1, window=10.0, reference=False)


def test_a_spring_against_a_frame_that_was_identified_before(tmp_path: Path) -> None:
    out = tmp_path / "run"
    run(KNOWN_REFERENCE, bench(identified=KNOWN), out)
    found = read_specimen(out / "specimen.json")
    assert found.names == ("k1", "k2", "k_c:0.64")
    assert close(found.finding("k_c:0.64"), SPRING * 0.64 * 213.44)
    spring = found.finding("k_c:0.64")
    # k1's own uncertainty does not cancel now
    assert spring is not None
    assert spring.standard_uncertainty > 0.16
    # k_C = k1(held) - k1 with k1(held) known independently
    expected = -0.16 / spring.standard_uncertainty
    assert found.correlation(("k_c:0.64", "k1"))[0, 1] == pytest.approx(expected, rel=1e-6)
    assert found.correlation(("k_c:0.64", "k2"))[0, 1] == pytest.approx(-0.5 * expected, rel=1e-6)


def test_the_pulse_keeps_its_distance_from_every_limit(tmp_path: Path) -> None:
    parameters = FreeVibrationParameters(drift=0.5)
    configuration = bench(limits=Limits(drift=0.04))
    found = plan_pulse(parameters, configuration, configuration.specimen.bare())
    assert (found.binds, found.drift) == ("drift", pytest.approx(SHARE * 0.04))
    preflight = compile_run("free-vibration", prepared(parameters, configuration), tmp_path)
    assert preflight.refusal is None
    assert preflight.margins[0].margin == pytest.approx(1.0 - SHARE)
    known = {margin.demand.quantity for margin in preflight.margins if margin.margin is not None}
    assert {"displacement", "velocity", "acceleration", "drive_voltage", "laser_1", "drift", "current"} <= known


@pytest.mark.parametrize(
    ("asked", "item", "told"),
    [
        (FreeVibrationParameters(drift=0.002), "drift", "0.003 m"),
        (FreeVibrationParameters(pulse=0.005), "pulse", "at least 0.01 s"),
        (FreeVibrationParameters(excitation="hand", pull=0.1), "pull", "measuring ranges"),
        (CouplingStiffnessParameters(reference=False), "reference", "not identified"),
    ],
)
def test_what_cannot_be_done_is_refused_beforehand(asked: Parameters, item: str, told: str) -> None:
    with pytest.raises(InvalidInput, match=told) as refusal:
        prepared(asked, BenchConfiguration())
    assert refusal.value.item == item


@pytest.mark.parametrize(
    ("values", "item"),
    [
        ({"excitation": "hand", "drift": 0.02}, "drift"),
        ({"excitation": "hand", "pulse": 0.5}, "pulse"),
        ({"pull": 0.03}, "pull"),
    ],
)
def test_what_would_have_no_effect_is_refused(values: dict[str, object], item: str) -> None:
    with pytest.raises(ValidationError, match=f"{item} = .* is refused: .* omit it"):
        FreeVibrationParameters(**values)  # type: ignore[arg-type]


WEIGHED = Identified(findings=(before("m1", 1.0624, 0.0004), before("m2", TRUE.m2, 0.0004)))


def test_a_weighing_that_the_specimen_file_overrules_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"m1 = 1\.0624 kg .*omit this parameter") as refusal:
        prepared(FreeVibrationParameters(mass_uncertainty=0.05), bench(identified=WEIGHED))
    assert refusal.value.item == "mass_uncertainty"


def test_a_frame_let_go_by_hand_says_the_same_and_other_masses_are_told(tmp_path: Path) -> None:
    out = tmp_path / "run"
    parameters = FreeVibrationParameters(excitation="hand", repeats=1, window=10.0, pull=0.025)
    result, events = run(parameters, bench(identified=WEIGHED), out)
    assert result.status == "completed"
    found = read_specimen(out / "specimen.json")
    assert all(close(found.finding(name), getattr(TRUE, name)) for name in found.names)
    assert {"k1", "k2", "xi1", "xi2"} <= set(found.names)
    asked = [event.request.split()[0] for event in events if isinstance(event, OperatorAsked)]
    assert asked == ["Remove", "Clamp", "Displace", "Remove"]
    assert not any("probe" in event.text for event in events if isinstance(event, StepStarted))
    assert any("m1 = 1.0624 kg" in event.text for event in events if isinstance(event, Warned))
    assert found.finding("m1") == WEIGHED.finding("m1")
    assert found.correlation(("k1", "m1"))[0, 1] > 0.3


def test_decays_of_different_length_are_drawn_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr("protocols.free_vibration.experiment.write_figure", lambda _, figure: drawn.append(figure))
    parameters = FreeVibrationParameters(excitation="hand", repeats=2, window=5.0, pull=0.025)
    result, events = run(parameters, bench(), tmp_path / "run", figures=True)
    assert result.status == "completed"
    fits = [event.columns["laser_1"].values for event in events if isinstance(event, FitFinished)]
    assert len({fit.size for fit in fits}) == 2
    (figure,) = drawn
    spectrum = figure.axes[2]
    assert {"laser 1", "laser 2"} <= {line.get_label() for line in spectrum.lines}


def test_a_slope_of_the_damping_is_told_with_its_expanded_uncertainty() -> None:
    none = np.zeros((2, 2))
    slopes = Combined(
        np.array([0.26, 0.01]), np.diag([0.05**2, 0.05**2]), none, np.ones(2), np.ones((1, 2)), np.ones(2)
    )
    frame = Combined(np.ones(8), np.eye(8), np.zeros((8, 8)), np.ones(8), np.ones((1, 8)), np.ones(8))
    result = FrameResult((), frame, slopes, (1.0, 1.0), none, np.zeros((8, 2)), np.zeros(8), {})
    assert "xi1 changes by 0.26 +- 0.10 (k = 2) per metre of drift; the" in nonlinear_text(result)


def test_a_run_that_fails_does_not_leave_the_table_clamped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def useless(*_: object) -> None:
        raise Unusable("nothing was seen")

    monkeypatch.setattr("protocols.free_vibration.experiment.released_decay", useless)
    parameters = FreeVibrationParameters(excitation="hand", repeats=1, window=5.0)
    result, events = run(parameters, bench(), tmp_path / "run")
    assert "no decay was usable" in result.reason
    asked = [event.request for event in events if isinstance(event, OperatorAsked)]
    assert asked[-1] == "Remove the clamp from the table."
    assert "STILL LOCKED" not in result.table


def test_a_spring_that_fails_does_not_leave_its_block_clamped(monkeypatch: pytest.MonkeyPatch) -> None:
    def useless(*_: object) -> Plan:
        raise Unmeasurable("no decay was usable")
        yield

    monkeypatch.setattr("protocols.coupling_stiffness.experiment.CouplingStiffness._decays", useless)
    springs, asked = prepared(KNOWN_REFERENCE, bench(identified=KNOWN)), []
    with pytest.raises(Unmeasurable):
        asked.extend(springs.plan())
    requests = [step.request for step in asked if isinstance(step, OperatorAction)]
    assert requests[-1].startswith("Remove the clamp, the spring and the block")
    assert "STILL CLAMPED" not in springs.result([]).text


def test_a_storey_held_by_a_hand_need_not_be_as_still_as_one_at_rest() -> None:
    armed: list[Arm] = []
    plan = prepared(FreeVibrationParameters(excitation="hand"), bench()).plan()
    step = next(plan)
    while not armed:
        armed += [step] if isinstance(step, Arm) else []
        step = plan.send(Done())
    plan.close()
    assert armed[0].still >= 1e-3
    assert armed[0].patience <= armed[0].rest


def test_a_table_or_block_that_stays_clamped_is_told() -> None:
    def until(plan: Plan, last: str) -> None:
        for step in plan:
            if isinstance(step, OperatorAction) and step.request.startswith(last):
                break
        plan.close()

    frame = prepared(FreeVibrationParameters(excitation="hand"), bench())
    springs = prepared(KNOWN_REFERENCE, bench(identified=KNOWN))
    until(frame.plan(), "Clamp")
    until(springs.plan(), "Set the block upright")
    assert "THE TABLE IS STILL LOCKED" in frame.result([]).text
    assert "THE BLOCK IS STILL CLAMPED" in springs.result([]).text


def test_numbers_are_written_with_as_many_digits_as_they_deserve() -> None:
    assert [in_brackets(221.9972, 0.1613), in_brackets(0.0130037, 6e-6)] == ["222.00(16)", "0.0130037(60)"]
    assert in_brackets(1.5, float("nan")) == "1.5"
    assert [plus_minus(221.9972, 0.323), plus_minus(2.0, 0.0)] == ["222.00 +- 0.32", "2"]
