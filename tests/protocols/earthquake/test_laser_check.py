"""The check of the lasers before the records: its sine, and the uncertainty of alpha_2 with and without it."""

import json
from collections.abc import Callable
from dataclasses import replace
from math import tau
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.sensor_uncertainty import LINEARITY, STEPS
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_1, LASER_2, SIGNALS, U1
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.control.target import Reach
from bench.datafile.reader import open_datafile
from bench.document.campaign import Campaign
from bench.document.document import Section
from bench.engine.steps import Publish
from bench.events import Warned
from bench.live_values import RunningGain
from protocols.common.sine.settling import linear_frame
from protocols.earthquake.laser_check import ABOVE, INSIDE, NAME, LaserCheck, LasersChecked, advice, laser_check
from protocols.earthquake.measurement import GainMonitor
from protocols.earthquake.observation import observe
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.report import seismic_sections
from protocols.earthquake.uncertainty import CHOICE, drift_errors
from sim.errors import InvalidInput
from sim.linear import steady_response
from tests.bench.calibrated import calibration
from tests.protocols.earthquake.test_campaign import bench as bench
from tests.protocols.earthquake.test_plan import ONE, played_through
from tests.protocols.earthquake.test_plan import stored as stored

pytestmark = pytest.mark.usefixtures("no_figures")

CONFIGURATION = BenchConfiguration()


def check_of(**parameters: Any) -> LaserCheck:
    found = laser_check(EarthquakeParameters(laser_check=True, **parameters), CONFIGURATION)
    assert found is not None
    return found


def test_no_check_is_made_unless_it_is_requested() -> None:
    assert laser_check(EarthquakeParameters(), CONFIGURATION) is None


def test_the_check_is_recommended_where_the_linearity_of_the_lasers_dominates() -> None:
    def point(linearity: float) -> dict[str, Any]:
        return {"alpha_2_uncertainty": 0.02, "uncertainty_parts": json.dumps({LINEARITY: linearity, CHOICE: 0.001})}

    points = [point(0.0099), point(0.005), point(0.008), {"alpha_2_uncertainty": None, "uncertainty_parts": ""}]
    plain = EarthquakeParameters(laser_block=0.0)
    assert "2 of 3" in advice(plain, CONFIGURATION, points)
    assert advice(EarthquakeParameters(laser_block=None), CONFIGURATION, points) == advice(plain, CONFIGURATION, points)
    calibrated = CONFIGURATION.model_copy(update={"calibrated": calibration(-0.05, 0.05)})
    assert advice(plain, CONFIGURATION, points[1:2]) == ""
    assert advice(EarthquakeParameters(laser_check=True, laser_block=0.0), CONFIGURATION, points) == ""
    assert advice(plain, calibrated, points) == ""
    # they are found in the motion
    assert advice(EarthquakeParameters(), CONFIGURATION, points) == ""


def test_the_sine_uses_most_of_a_limit_and_exceeds_none() -> None:
    check, limits, reach = check_of(), CONFIGURATION.limits, Reach.of(CONFIGURATION)
    frame = CONFIGURATION.known_specimen.bare()
    assert check.omega == pytest.approx(ABOVE * min(frame.frame.natural_frequencies))
    first, second = (abs(each) for each in steady_response(frame, check.omega, check.amplitude))
    table = check.amplitude / check.omega**2
    drift = abs(np.subtract(*steady_response(frame, check.omega, check.amplitude)))
    shares = [drift / limits.drift, table / reach.displacement]
    shares += [
        abs(each - table) / half for each, half in zip((first, second), CONFIGURATION.laser_half_ranges, strict=True)
    ]
    assert 0.5 < max(shares) < 0.9
    target = check.shaking.target
    assert check.shaking.prepared.peak == pytest.approx(check.amplitude, rel=0.01)
    assert np.abs(target.acceleration[[0, -1]]).max() < 1e-3 * check.amplitude
    # the evaluated part is a pure sine
    part = target.acceleration[check.first :][: round(20.0 * tau / check.omega * target.sample_rate)]
    spectrum = np.abs(np.fft.rfft(part * np.hanning(part.size)))
    assert spectrum[40:].max() < 1e-4 * spectrum.max()


def test_a_band_above_the_first_mode_moves_the_sine_into_it_and_a_narrow_one_is_refused() -> None:
    assert check_of(table_band="2:25").omega == pytest.approx(INSIDE * tau * 2.0)
    with pytest.raises(InvalidInput, match="laser-check"):
        check_of(table_band="2:2.5")


def signals_of(check: LaserCheck, error: float) -> np.ndarray:
    """Signals of a linear frame in its steady state, with an `error` [m] times the square of the relative reading of
    the first laser.
    """
    target = check.shaking.target
    signals = np.zeros((target.acceleration.size, len(SIGNALS)))
    phase = check.omega * np.arange(len(signals)) / target.sample_rate
    signals[:, ACCELERATION] = check.amplitude * np.sin(phase)
    first, second = linear_frame(CONFIGURATION).readings(check.omega, check.amplitude)
    relative = np.imag(first * np.exp(1j * phase)) / abs(first)
    signals[:, LASER_1] = abs(first) * relative + error * relative**2
    signals[:, LASER_2] = np.imag(second * np.exp(1j * phase))
    signals[:, DRIFT] = signals[:, LASER_2] - signals[:, LASER_1]
    return signals


def test_harmonics_are_those_of_the_error_of_a_laser() -> None:
    check, error = check_of(), 1e-4
    first, second = check.evaluate(signals_of(check, error), CONFIGURATION)
    # the square of a sine is (1 - cos(2 phase)) / 2
    assert abs(first.found[0]) == pytest.approx(0.5 * error, rel=1e-3)
    assert np.abs(first.found[1:]).max() < 1e-9
    assert np.abs(second.found).max() < 1e-9
    assert second.swing == pytest.approx(
        2.0 * abs(linear_frame(CONFIGURATION).readings(check.omega, check.amplitude)[1]), rel=1e-3
    )


def test_a_check_with_too_many_missing_samples_is_refused() -> None:
    check = check_of()
    signals = signals_of(check, 0.0)
    signals[check.first :: 50] = np.nan
    signals[check.first :][: round(20.0 * tau / check.omega * check.shaking.target.sample_rate)] = np.nan
    with pytest.raises(InvalidInput, match="laser check"):
        check.evaluate(signals, CONFIGURATION)


def test_a_check_that_fails_leaves_the_campaign_without_it(
    stored: Callable[..., BenchConfiguration], monkeypatch: pytest.MonkeyPatch
) -> None:
    def evaluate(*_arguments: object) -> None:
        raise InvalidInput("laser check", "3 cycles", "at least 12 without missing samples are required")

    monkeypatch.setattr(LaserCheck, "evaluate", evaluate)
    asked = ONE.model_copy(update={"laser_check": True})
    steps, (point,) = played_through(stored(), asked, lambda *_: None)
    assert point.status == "measured"
    warned = [step.event.text for step in steps if isinstance(step, Publish) and isinstance(step.event, Warned)]
    assert any("the lasers are not checked" in text and "3 cycles" in text for text in warned)


def test_calibrated_lasers_have_the_zero_from_momentum_without_a_check(
    stored: Callable[..., BenchConfiguration],
) -> None:
    calibrated = stored().model_copy(update={"calibrated": calibration(-0.1, 0.1)})
    by_calibration, found = ONE.model_copy(update={"laser_block": 0.0}), ONE
    (_, (point,)), (_, (narrower,)) = (
        played_through(calibrated, each, lambda *_: None) for each in (by_calibration, found)
    )
    assert point.alpha_2 is not None
    assert point.drift_peak_m is not None
    # what a calibration leaves of the lasers' errors is found in the motion
    assert narrower.alpha_2_uncertainty < 0.5 * point.alpha_2_uncertainty
    # the zeros at rest of two lasers, each within one step
    at_rest = point.alpha_2 * calibrated.analysis.laser_resolution / np.sqrt(6.0) / point.drift_peak_m
    assert json.loads(point.uncertainty_parts)[STEPS] < 0.3 * at_rest


QUICK = ("--tolerance", "0.05", "--spectrum-tolerance", "0.1", "--decay", "1", "--length-ratio", "0.25")
"""One pass of a record in half its time: the lasers err whatever the motion."""


def run(folder: Path, bench: Path, *options: str) -> dict[str, Any]:
    asked = ["synthetic:l-aquila", "--table-band", "1:25", "--beta", "0.25", "--seed", "4", "--config", str(bench)]
    asked += [*QUICK, "--draws", "40"]
    assert main(["run", "earthquake", *asked, *options, "--out", str(folder)]) == 0
    (point,) = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["points"]
    return point


def test_a_check_narrows_the_uncertainty_and_the_motion_even_more_and_the_files_replay(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    without = run(tmp_path / "without", bench, "--laser-block", "0")
    assert "--laser-check measures" in capsys.readouterr().out
    checked = run(tmp_path / "checked", bench, "--laser-check", "--laser-block", "0")
    assert "--laser-check measures" not in capsys.readouterr().out
    found = run(tmp_path / "found", bench)
    assert "--laser-check measures" not in capsys.readouterr().out
    for one in (checked, found):
        assert one["agrees"] is True
        assert one["alpha_2"] == pytest.approx(without["alpha_2"], rel=0.005)
    assert checked["alpha_2_uncertainty"] < 0.4 * without["alpha_2_uncertainty"]
    assert found["alpha_2_uncertainty"] < 0.1 * without["alpha_2_uncertainty"]
    # the specimen of the simulated bench is the one that is predicted
    assert found["alpha_2"] == pytest.approx(found["alpha_2_predicted"], rel=0.002)
    recommended: list[bool] = []
    for name in ("without", "checked"):
        with open_datafile(path := tmp_path / name / "campaign.h5") as record:
            (section,) = seismic_sections(Campaign(path, record))
        recommended.append(any("1 of 1" in part and "--laser-check" in part for part in texts(section)))
    assert recommended == [True, False]
    with open_datafile(tmp_path / "checked" / "campaign.h5") as record:
        (said,) = [event.text for event in record.events if event.kind == "LasersChecked"]
        running = [row for row in record.rows_of(RunningGain) if row["record"] != NAME]
    assert "corrected by up to" in said
    # the largest corrected sample, and the peak fitted to the corrected samples, with another zero
    for beta, peak in ((None, checked["bare_drift_peak_m"]), (0.25, checked["drift_peak_m"])):
        largest = max(row["drift_peak"] for row in running if row["beta"] == beta)
        assert largest == pytest.approx(peak, rel=0.005)
    for name in ("checked", "found"):
        capsys.readouterr()
        assert main(["replay", str(tmp_path / name / "campaign.h5")]) == 0
        assert "Bit-identical to the file" in "".join(capsys.readouterr())


def texts(section: Section) -> list[str]:
    return [part for part in section.parts if isinstance(part, str)]


def test_the_journal_states_the_correction() -> None:
    check = check_of()
    checks = check.evaluate(signals_of(check, 1e-4), CONFIGURATION)
    said = LasersChecked.of(ReadingCorrection(CONFIGURATION.sensors.corrected_by(checks)))
    assert said.swings == (checks[0].swing, checks[1].swing)
    # a parabola: its largest error is at the ends of the swing, apart from the slope, which harmonics do not tell
    assert said.corrections[0] == pytest.approx(1e-4, rel=0.3)
    assert said.corrections[1] < 1e-6
    assert "corrected by up to" in said.line
    calibrated = replace(CONFIGURATION.sensors, calibration=calibration(-0.1, 0.1)).corrected_by(checks)
    assert LasersChecked.of(ReadingCorrection(calibrated)).line.endswith("their readings are not corrected")


def test_the_running_peak_is_that_of_the_corrected_drift() -> None:
    check, error = check_of(), 1e-4
    sensors = CONFIGURATION.sensors.corrected_by(check.evaluate(signals_of(check, error), CONFIGURATION))
    correction, signals = ReadingCorrection(sensors), signals_of(check, error)[:5000]
    monitor, peaks = GainMonitor("made", None, 1000.0, correction=correction), list[float]()
    for block in np.split(signals, 10):
        peaks.append(monitor(block).drift_peak)
    true = np.abs(signals_of(check, 0.0)[:5000, DRIFT]).max()
    assert peaks[-1] == pytest.approx(np.abs(correction(signals)[:, DRIFT]).max(), rel=1e-12)
    uncorrected = np.abs(signals[:, DRIFT]).max()
    assert abs(peaks[-1] - true) < 0.3 * abs(uncorrected - true)


def test_another_peak_of_almost_the_same_size_adds_the_choice_between_them() -> None:
    """A drift with peaks of 50 and -49.9 mm, at opposite places of laser 1, whose error was found by the check."""
    rate, still = 1000.0, 2000
    time = np.arange(10_000) / rate
    signals = np.zeros((time.size, len(SIGNALS)))
    pulse = [height * np.exp(-(((time - at) / 0.1) ** 2)) for height, at in ((0.05, 4.0), (-0.0499, 6.0), (0.045, 8.0))]
    signals[:, LASER_1] = -np.sum(pulse, axis=0)
    signals[:, DRIFT] = -signals[:, LASER_1] + 1e-6 * np.random.default_rng(1).standard_normal(time.size)
    signals[:, U1] = signals[:, DRIFT]
    signals[:, ACCELERATION] = np.sin(20.0 * time) * (time > 2.0)
    seen = observe(signals, still, rate).drift
    assert seen.peak.value == pytest.approx(0.05, rel=1e-4)
    (other,) = seen.others
    assert (other.peak.value, other.peak.sign) == (pytest.approx(0.0499, rel=1e-4), -1)
    assert other.peak.time == pytest.approx(6.0, abs=1e-3)
    sensors = CONFIGURATION.sensors
    assert CHOICE not in drift_errors((seen, seen), sensors, 100, 1)
    check = check_of()
    checked = sensors.checked_by(check.evaluate(signals_of(check, 1e-4), CONFIGURATION))
    choice = drift_errors((seen, seen), checked, 2000, 1)[CHOICE]
    # the other peak is larger in some of the draws, and the largest is never smaller than the chosen one
    assert choice.max() == 0.0
    assert 0.05 < np.mean(choice < 0.0) < 0.95
