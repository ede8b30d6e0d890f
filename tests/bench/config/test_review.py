"""Cross-checks of a configuration: limits that could never trip, contradictions, and notices of what is unusual."""

import re
from collections.abc import Callable
from datetime import UTC, datetime
from math import pi
from pathlib import Path

import numpy as np
import pytest

from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.app.preflight import compile_run
from bench.config.model import BenchConfiguration
from bench.config.review import review
from bench.config.toml import problems_of, read_configuration
from bench.config.usual import notices_of, scales_of
from bench.guard.limits import Debounce, Limits
from bench.prediction.requests import SineRequest
from drivers.hardware.parameters import CoilCurrent, Hardware, TableAcceleration, TableDisplacement, TableForce
from protocols.check.protocol import CheckParameters
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.identified import Finding, Identified
from sim.specimen import Frame, Specimen, Spring

FILE = Path("bench.toml")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_defaults_of_both_backends_are_without_a_word() -> None:
    for backend in ("simulated", "hardware"):
        found = review(BenchConfiguration(backend=backend))
        assert (found.refusals, found.notices) == ((), ())


@pytest.mark.parametrize(
    ("backend", "limit", "slip"),
    [
        (backend, limit, slip)
        for backend in ("simulated", "hardware")
        for limit, slip in (
            ("displacement", 60.0),
            ("velocity", 600.0),
            ("acceleration", 6000.0),
            ("drift", 80.0),
            ("force", 7e5),
            ("current", 16000.0),
            ("heating", 9000.0),
            ("laser_range", 99.0),
            ("drive_slew", 4e5),
        )
        if (backend, limit) not in {("hardware", "force"), ("hardware", "current"), ("hardware", "heating")}
    ],
)
def test_a_limit_that_could_never_trip_is_refused_unless_it_is_confirmed(
    backend: str, limit: str, slip: float, capsys: pytest.CaptureFixture[str]
) -> None:
    FILE.write_text(f'backend = "{backend}"\n[limits]\n{limit} = {slip}\n', encoding="utf-8")
    (problem,) = problems_of(FILE)
    assert (problem.item, problem.value) == (f"bench.toml: limits.{limit}", slip)
    assert re.search(r"it can never trip: .* allows at most ", problem.allowed)
    with pytest.raises(InvalidInput) as caught:
        read_configuration(FILE)
    assert str(caught.value) == str(problem)
    # three commands, one answer
    for command in (["config", "check"], ["check", "--dry-run", "--config"], ["check", "--config"]):
        assert main([*command, str(FILE)]) == 2
        assert str(problem) in capsys.readouterr().err
    FILE.write_text(f'backend = "{backend}"\n[limits]\n{limit} = {slip}\nconfirmed = ["{limit}"]\n', encoding="utf-8")
    assert problems_of(FILE) == []
    assert main(["config", "check", str(FILE)]) == 0
    assert re.search(rf"warning: limits.{limit} = .* limits.confirmed names it", capsys.readouterr().err)
    preflight = compile_run(
        "check", load_protocol("check").prepare(CheckParameters(), read_configuration(FILE), None), Path("run")
    )
    assert any(f"limits.{limit}" in warning for warning in preflight.warnings)
    assert preflight.refusal is None


def test_a_configuration_that_no_file_holds_is_refused_alike() -> None:
    wide = BenchConfiguration(limits=Limits(drift=80.0))
    refusal = compile_run("check", load_protocol("check").prepare(CheckParameters(), wide, None), Path("run")).refusal
    assert refusal is not None
    assert refusal.item == "limits.drift"


def test_load_limits_of_the_laboratory_are_held_against_its_sensors_or_the_estimate() -> None:
    known = Hardware(moving_mass=50.0, force_constant=50.0)
    measured = Hardware(table_force=TableForce(sensitivity=-0.02), coil_current=CoilCurrent(sensitivity=0.5))
    for hardware, limits, refused in (
        (known, Limits(), []),
        (known, Limits(force=7e3, current=1.6e3), ["limits.force", "limits.current"]),
        (measured, Limits(), ["limits.force"]),
        (measured, Limits(force=450.0, current=21.0), ["limits.current"]),
    ):
        found = review(BenchConfiguration(backend="hardware", hardware=hardware, limits=limits))
        assert [refusal.item for refusal in found.refusals] == refused


@pytest.mark.parametrize("kind", [TableDisplacement, TableAcceleration, TableForce, CoilCurrent])
def test_a_scale_is_never_zero(kind: type[TableDisplacement]) -> None:
    with pytest.raises(ValueError, match=r"sensitivity = 0.0 is refused"):
        kind(sensitivity=0.0)
    with pytest.raises(ValueError, match=r"zero = 12.0 is refused: it must be within the input's range of 10 V"):
        kind(zero=12.0)
    FILE.write_text("[hardware.table_displacement]\nsensitivity = 0\n", encoding="utf-8")
    assert problems_of(FILE)[0].item == "bench.toml: hardware.table_displacement.sensitivity"


@pytest.mark.parametrize(
    ("text", "item"),
    [
        ("[simulation.bench.shaker]\nband_low = 200", "simulation.bench.shaker.band_low"),
        ("[simulation.bench.shaker]\nband_high = 5000", "simulation.bench.shaker.band_high"),
        ("[limits]\ndrive_slew = 10", "ramps.abort"),
        ("[specimen.frame]\nm1 = 1062\nm2 = 1062\nk1 = 2e5\nk2 = 5e4", "specimen.frame.m1"),
        ("[specimen.block]\nrho = 2450000", "specimen.frame.m1"),
    ],
)
def test_what_physics_decides_is_refused(text: str, item: str) -> None:
    FILE.write_text(text, encoding="utf-8")
    assert [problem.item for problem in problems_of(FILE)] == [f"bench.toml: {item}"]


@pytest.mark.parametrize(
    ("configuration", "notice"),
    [
        (lambda: BenchConfiguration(limits=Limits(stuck=50.0)), r"limits\.stuck = 50 s is above the usual"),
        (
            lambda: BenchConfiguration(limits=Limits(debounce=Debounce(drift=0.5))),
            r"limits\.debounce\.drift = 0\.5 s is above the usual range, 0\.001 to 0\.05 s",
        ),
        (lambda: _specimen(xi1=0.35), r"specimen\.frame\.xi1 = 0\.35 is above the usual range, 0\.001 to 0\.15"),
        (lambda: _specimen(k1=0.21344, k2=0.05645), r"specimen\.frame\.k1 = 0\.21344 N/m is below the usual"),
        (
            lambda: _specimen(xi1=0.02, xi2=0.01),
            r"specimen\.frame\.xi1 = 0\.02, xi2 = 0\.01 .* dashpot c1 = -0\.5\d* N s/m; .* xi2/xi1 from \d",
        ),
        (
            lambda: BenchConfiguration(specimen=Specimen(springs=(Spring(label=0.25, k_c=5.3),))),
            r"specimen\.springs\[0\]\.k_c = 5\.3 N/m is 0\.0993 times 53\.36 N/m, .* label 0\.25",
        ),
    ],
)
def test_what_is_merely_unusual_gets_a_notice(configuration: Callable[[], BenchConfiguration], notice: str) -> None:
    found = review(configuration())
    assert found.refusals == ()
    assert any(re.search(notice, each) for each in found.notices), found.notices


@pytest.mark.parametrize(("xi1", "xi2", "which"), [(0.02, 0.01, 0), (0.01, 0.09, 1)])
def test_a_negative_dashpot_is_named_with_the_ratios_that_avoid_it(xi1: float, xi2: float, which: int) -> None:
    (notice,) = (each for each in review(_specimen(xi1=xi1, xi2=xi2)).notices if "dashpot" in each)
    assert f"give a dashpot c{which + 1} = {_dashpots(xi1, xi2)[which]:.3g} N s/m;" in notice
    ends = re.search(r"from ([\d.]+) to ([\d.]+)$", notice)
    assert ends is not None
    low, high = map(float, ends.groups())
    for inside, outside in ((low, 0.995 * low), (high, 1.005 * high)):
        assert min(_dashpots(xi1, inside * xi1)) >= 0.0
        assert min(_dashpots(xi1, outside * xi1)) < 0.0


def _dashpots(xi1: float, xi2: float) -> tuple[float, float]:
    """c1, c2 of the default frame with these damping ratios, with modes from a general eigensolver."""
    frame = Frame()
    stiffness = np.array([[frame.k1 + frame.k2, -frame.k2], [-frame.k2, frame.k2]]) / frame.m1
    squares, modes = np.linalg.eigh(stiffness)
    modes /= np.sqrt(frame.m1)
    shares = np.stack((modes[0] ** 2, (modes[1] - modes[0]) ** 2), axis=1)
    c1, c2 = np.linalg.solve(shares, 2.0 * np.sqrt(squares) * (xi1, xi2))
    return float(c1), float(c2)


def test_identified_damping_ratios_that_make_a_dashpot_negative_get_a_notice() -> None:
    date = datetime(2026, 1, 1, tzinfo=UTC)
    findings = tuple(
        Finding(name=name, value=value, standard_uncertainty=0.01 * value, source="decay", date=date)
        for name, value in (("xi1", 0.02), ("xi2", 0.01))
    )
    (notice,) = review(BenchConfiguration(identified=Identified(findings=findings))).notices
    assert notice.startswith("identified: xi1 = 0.02, xi2 = 0.01 give a dashpot c1 = -0.502 N s/m")


def test_a_prediction_warns_of_a_negative_dashpot(capsys: pytest.CaptureFixture[str]) -> None:
    Path("specimen.toml").write_text("[frame]\nxi1 = 0.02\nxi2 = 0.01\n", encoding="utf-8")
    assert main(["predict", "modes", "--specimen", "specimen.toml"]) == 0
    assert "specimen.frame.xi1 = 0.02, xi2 = 0.01 give a dashpot c1 = -0.502 N s/m" in capsys.readouterr().err


def _specimen(**frame: float) -> BenchConfiguration:
    return BenchConfiguration(specimen=Specimen(frame=Frame(**frame)))


def test_a_frequency_in_hertz_typed_for_one_in_radians_a_second_is_noticed() -> None:
    (notice,) = notices_of(HarmonicParameters(omega=(2.5, 16.0)), Specimen())
    assert notice.startswith("omega[0] = 2.5 rad/s = 0.40 Hz is far below the modes of the bare frame, 6.32 and 16.4")
    assert "if the value is in Hz" in notice
    (notice,) = notices_of(SineRequest(omega=(2.5 * (2.0 * pi) ** 2,)), Specimen())
    assert "is far above" in notice
    assert notices_of(HarmonicParameters(), Specimen()) == ()


def test_a_plan_states_its_frequencies_in_hertz_beside_the_modes() -> None:
    lines = scales_of(HarmonicParameters(omega=(5.0 * pi,)), Specimen())
    assert lines[0] == "omega = 15.71 rad/s = 2.5 Hz"
    assert lines[1] == "modes of the bare frame: 6.322 rad/s = 1.006 Hz and 16.35 rad/s = 2.602 Hz"


def test_a_prediction_warns_and_goes_on(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["predict", "modes", "--beta", "25", "--json"]) == 0
    assert "warning: beta[0] = 25 is above the usual range, 0.02 to 5" in capsys.readouterr().err


@pytest.mark.parametrize("key", ["watchdog", "heartbeat.timeout"])
def test_time_outs_of_the_enable_chain_outlast_a_loop_that_is_late_by_the_lead(key: str) -> None:
    def refused(value: float, lead: float) -> list[str]:
        heartbeat = {"heartbeat": {"timeout": value}} if key != "watchdog" else {"watchdog": value}
        content = {"backend": "hardware", "acquisition": {"lead": lead}, "hardware": {"daq": heartbeat}}
        found = review(BenchConfiguration.model_validate(content)).refusals
        return [str(each) for each in found if f"hardware.daq.{key} = " in str(each)]

    least = 0.8 if key == "watchdog" else 0.7
    (said,) = refused(least - 0.05, 0.5)
    assert f"and this time, {least:g} s, or reduce acquisition.lead" in said
    assert refused(least + 0.05, 0.5) == []
    # a block that is later than limits.late ends the run
    assert refused(least + 0.05, 2.0) == []
