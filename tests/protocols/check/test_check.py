"""`rockbench check` from end to end: the simulated bench passes, and what is wrong is named."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import bench
import bench.app.session
from bench.analysis.check_line import passed
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.rigs import open_rig
from drivers.rig import Channel, Rig
from protocols.check.experiment import LoopCheck
from protocols.check.protocol import CheckParameters
from tests.undrawn import undrawn

SHORT = ("--cycles", "4", "--rest", "1")
LONG_BLOCKS = "[acquisition]\nblock_duration = 0.2\n"

Check = Callable[..., tuple[int, list[dict[str, Any]]]]


@pytest.fixture
def check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Check:
    """Runs a check, a short one unless flags are given, on a configuration and returns its exit code and lines."""

    def run(configuration: str = "", *flags: str) -> tuple[int, list[dict[str, Any]]]:
        file = tmp_path / "bench.toml"
        file.write_text(configuration if flags else LONG_BLOCKS + configuration, encoding="utf-8")
        with undrawn():
            code = main(["check", "--config", str(file), "--out", str(tmp_path / "out"), "--json", *(flags or SHORT)])
        return code, json.loads(capsys.readouterr().out)["points"]

    return run


def failures(lines: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [(line["subject"], line["what"]) for line in lines if line["verdict"] == "failed"]


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in (2, 3, 4, 5))])
def test_the_simulated_bench_passes_every_line(check: Check, seed: int, tmp_path: Path) -> None:
    code, lines = check("", "--seed", str(seed))
    assert failures(lines) == []
    assert code == 0
    assert {line["verdict"] for line in lines} == {"passed"}
    delays = {line["subject"]: line["measured"] for line in lines if line["what"] == "delay against table_displacement"}
    # the accelerometer follows each step of the held output, so it lags by half a sample
    assert delays.pop("table_acceleration") == pytest.approx(0.5 / 2000.0, abs=3e-5)
    # two measurements at 4 kHz, and half of one until it is replaced; the filter is the same in every channel
    assert delays == {name: pytest.approx(2.5 / 4000.0, abs=1.5e-4) for name in ("laser_1", "laser_2")}
    with open_datafile(tmp_path / "out" / "campaign.h5") as record:
        assert [point["verdict"] for point in record.points] == [line["verdict"] for line in lines]
        done = [event.text for event in record.events if event.kind == "OperatorAnswered"]
    assert "clamp" in done[0]
    assert "Remove the clamps" in done[-1]


@pytest.mark.parametrize(
    ("configuration", "line"),
    [
        (
            "[simulation.bench.accelerometer]\nscale_error = 0.06\n",
            ("table_acceleration", "scale against table_displacement"),
        ),
        (
            "[simulation.bench.displacement_sensor]\nscale_error = -0.06\n",
            ("table_displacement", "scale against table_acceleration"),
        ),
        ("[simulation.bench.displacement_sensor]\nnoise_density = 5e-5\n", ("table_displacement", "noise at rest")),
    ],
)
def test_what_is_wrong_fails_on_exactly_its_line(check: Check, configuration: str, line: tuple[str, str]) -> None:
    code, lines = check(configuration)
    assert failures(lines) == [line]
    assert code == 1


def test_a_late_laser_fails_against_both_sensors_of_the_table(check: Check) -> None:
    code, lines = check("[simulation.bench.laser_1]\nlatency = 4\n", "--cycles", "8")
    assert sorted(failures(lines)) == [
        ("laser_1", "delay against table_acceleration"),
        ("laser_1", "delay against table_displacement"),
    ]
    assert code == 1


def test_a_laser_of_another_scale_fails_for_itself_and_for_the_difference(check: Check) -> None:
    code, lines = check("[simulation.bench.laser_1]\nscale_error = 0.06\n")
    assert failures(lines) == [
        ("laser_1", "scale against table_displacement"),
        ("lasers", "scale of laser_2 against laser_1"),
    ]
    assert code == 1


@pytest.mark.parametrize(
    "names",
    [
        ["table_acceleration", "laser_2"],
        *(pytest.param([name], marks=pytest.mark.soak) for name in ("table_acceleration", "laser_1", "laser_2")),
    ],
)
def test_a_reversed_sensor_fails_on_its_polarity(
    check: Check, monkeypatch: pytest.MonkeyPatch, names: list[str]
) -> None:
    monkeypatch.setattr(bench.app.session, "open_rig", _reversing(names))
    code, lines = check()
    assert failures(lines) == [(name, "polarity against table_displacement") for name in names]
    assert code == 1


def _reversing(names: list[str]) -> Callable[..., Rig]:
    """Opens the simulated bench with the signs of some calibrations turned round."""

    def turned(channel: Channel) -> Channel:
        return replace(channel, scale=-channel.scale, offset=-channel.offset) if channel.name in names else channel

    return _with_channels(turned)


def _with_channels(changed: Callable[[Channel], Channel]) -> Callable[..., Rig]:
    """Opens the simulated bench with some channels changed."""

    def opened(configuration: BenchConfiguration, *, realtime: bool) -> Rig:
        rig = open_rig(configuration, realtime=realtime)
        channels = tuple(changed(channel) for channel in rig.channels)
        wired = type("Rewired", (type(rig),), {"channels": property(lambda _self: channels)})
        rig.__class__ = wired
        return rig

    return opened


def test_samples_that_are_missing_in_motion_are_explained(check: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    def narrow(channel: Channel) -> Channel:
        # 6 mm to either side: the motion at the lowest frequency, 7.5 mm, is beyond it for a moment only
        if channel.name != "laser_2":
            return channel
        middle, reach = sum(channel.valid) // 2, round(0.006 / abs(channel.scale))
        return replace(channel, valid=(middle - reach, middle + reach))

    monkeypatch.setattr(bench.app.session, "open_rig", _with_channels(narrow))
    code, lines = check()
    assert failures(lines) == [("bench", "motion")]
    remedy = next(line["remedy"] for line in lines if line["verdict"] == "failed")
    assert "cycles have missing samples of laser_2: beyond the" in remedy
    assert "reduce the motion" in remedy
    assert code == 1


def test_a_table_that_does_not_answer_is_a_line_and_the_clamps_come_off(check: Check, tmp_path: Path) -> None:
    code, lines = check("[simulation.bench.shaker]\ngain = 1e-9\n")
    assert failures(lines) == [("bench", "motion")]
    assert code == 1
    with open_datafile(tmp_path / "out" / "campaign.h5") as record:
        assert record.status == "completed"
        asked = [event.text for event in record.events if event.kind == "OperatorAsked"]
    assert asked[-1] == "Remove the clamps from the storeys."


def test_lasers_on_the_table_are_not_tested_for_delay(check: Check) -> None:
    on_table = "".join(f'[simulation.bench.laser_{k}]\nreference = "table"\n' for k in (1, 2))
    code, lines = check(on_table)
    assert failures(lines) == []
    assert [line["subject"] for line in lines if line["verdict"] == "untested"] == ["lasers"]
    assert code == 0


@pytest.mark.parametrize(
    ("configuration", "flags", "words"),
    [
        ("[limits]\nvelocity = 0.05\n", (), ("velocity = 0.06", "limits.velocity = 0.05")),
        ("", ("--omega", "0.5", "8", "12", "18"), ("omega = 0.5", "120.0 mm", "60.0 mm")),
        ("[limits]\nacceleration = 2.0\n", (), ("omega = 40", "2.4 m/s2")),
        ("", ("--omega", "8", "8", "12", "18"), ("once",)),
    ],
)
def test_motions_beyond_the_bench_are_refused(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    configuration: str,
    flags: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    file = tmp_path / "bench.toml"
    file.write_text(configuration, encoding="utf-8")
    assert main(["check", "--config", str(file), "--out", str(tmp_path / "out"), *flags]) == 2
    # what takes long is announced before it is refused; the refusal is one line, the last
    *announced, refusal = capsys.readouterr().err.splitlines()
    assert not any("error" in line for line in announced)
    for word in words:
        assert word in refusal
    assert not (tmp_path / "out").exists()


def test_the_text_names_the_remedy_below_a_failed_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A storey out of range: all but a few measurements are none, and nothing else fails."""
    file = tmp_path / "bench.toml"
    file.write_text("[simulation.bench.laser_2]\nnoise = 20.0\n", encoding="utf-8")
    assert main(["check", "--config", str(file), "--out", str(tmp_path / "out"), *SHORT]) == 1
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("FAILED"))
    assert "laser_2" in lines[at]
    assert "-> beyond the" in lines[at + 1]
    assert "6 passed, 1 failed, 1 untested.\n" in captured.out
    assert "FAILED: laser_2, valid samples at rest" in captured.err


def test_an_interrupted_check_is_not_completed_and_not_passed(tmp_path: Path) -> None:
    """The operator does not clamp the storeys: nothing is measured, and nothing may be called passed."""
    with bench.run("check", operator=lambda _: False, out=tmp_path / "out") as campaign:
        assert campaign.status != "completed"
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["passed"] is False


def test_counts_of_an_interrupted_check_are_marked_as_incomplete() -> None:
    check = LoopCheck(CheckParameters(), BenchConfiguration())
    result = check.result([passed("table_acceleration", "noise at rest")] * 2)
    assert result.text.endswith("\n2 passed. The check was not completed: further lines are missing.")
    assert result.passed is False
