"""The laser calibration: against errors that are known exactly, applied to signals, kept, aged, refused."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.random import SeedSequence

from bench.analysis.cycles import CycleAnalyser
from bench.analysis.draws import Draws
from bench.analysis.laser_calibration import LaserCalibration, LaserCurve
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import LINEARITY, SCALES, SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2, SIGNALS, U1, SignalMap
from bench.app.catalogue import load_protocol
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_calibration, write_calibration
from bench.config.sections import Acquisition, Simulation
from bench.config.template import as_toml
from bench.config.toml import read_configuration
from bench.datafile.reader import open_datafile
from bench.engine.steps import AcquireAtRest, Done, OperatorAction, RestSamples
from drivers.rig import Channel, OperatorTask
from protocols.common.calibrate import Unmeasurable
from protocols.laser_calibration.curves import HARMONICS, ErrorCurve, Pass, fit_curve, mean_pass
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from protocols.laser_calibration.reference import fit_reference
from protocols.laser_calibration.scales import calibration, disagreements, require_agreement
from sim.channel import STOREYS
from sim.errors import InvalidInput
from sim.sensors import Laser
from sim.virtual_bench import VirtualBenchParameters
from tests.protocols.progress import ends_at_100_percent, followed

PROTOCOL = load_protocol("laser-calibration")
RANGE = 0.2
PHASES = np.arange(256) * 2.0 * np.pi / 256
RESTS = (0.003, -0.002)
SCALES_TRUE, DELAYS, YIELDS, TURNS = (1.0006, 0.9995), (6e-4, 4e-4), (2e-5, 6e-5), (0.7, 2.9)
DISPLACEMENT_SHOWS = 1.004


def error(laser: int, place: np.ndarray) -> np.ndarray:
    """What a laser says too much at a place [m] in its range, as the data sheet allows it to."""
    bent = 0.0008 * RANGE * np.sin(2.0 * np.pi * 1.5 * place / RANGE + TURNS[laser])
    return (SCALES_TRUE[laser] - 1.0) * place + bent


def made_pass(omega: float, amplitude: float, random: np.random.Generator, noise: float) -> Pass:
    """One slow sine with a third harmonic of the table, seen by two lasers."""
    x = amplitude * (np.sin(PHASES) + 0.01 * np.sin(3.0 * PHASES + 0.5))
    v = omega * amplitude * (np.cos(PHASES) + 0.03 * np.cos(3.0 * PHASES + 0.5))
    lasers = []
    for k in range(2):
        place = RESTS[k] + x * (1.0 + YIELDS[k] * omega**2)
        shown = place + error(k, place) - DELAYS[k] * v
        zero = RESTS[k] + float(error(k, np.array(RESTS[k])))
        lasers.append(shown - zero + noise * random.standard_normal(x.size))
    return Pass(omega, DISPLACEMENT_SHOWS * x, DISPLACEMENT_SHOWS * v, (lasers[0], lasers[1]), 1.001 * x)


def found(noise: float = 0.0) -> LaserCalibration:
    random = np.random.default_rng(3)
    passes = [made_pass(4.0 if k < 4 else 8.0, 0.05 * (1.0 - 0.01 * k), random, noise) for k in range(8)]
    rests = [RESTS[k] + float(error(k, np.array(RESTS[k]))) for k in range(2)]
    return calibration(
        passes,
        (fit_curve(passes, 0, rests[0]), fit_curve(passes, 1, rests[1])),
        (rests[0], rests[1]),
        ("laser A", "laser B"),
        SensorAccuracy(),
        (RANGE, RANGE),
        common_linearity=5e-5,
        valid_days=30.0,
        date=datetime(2026, 5, 4, 12, tzinfo=UTC),
    )


def left(one: LaserCalibration, laser: int, places: np.ndarray) -> np.ndarray:
    """What the corrected laser still says too much, counted from its rest [m]."""
    corrected = one.lasers[laser].corrected(places + error(laser, places))
    at_rest = one.lasers[laser].corrected(np.array([RESTS[laser]]) + error(laser, np.array([RESTS[laser]])))
    return corrected - at_rest - (places - RESTS[laser])


def curves_of(scale: float) -> tuple[list[Pass], tuple[ErrorCurve, ErrorCurve], tuple[float, float]]:
    """Passes and curves with a laser 2 that shows `scale` times as much."""
    random = np.random.default_rng(3)
    passes = [made_pass(4.0 if k < 4 else 8.0, 0.05 * (1.0 - 0.01 * k), random, 3e-6) for k in range(8)]
    passes = [replace(each, lasers=(each.lasers[0], scale * each.lasers[1])) for each in passes]
    rests = RESTS[0] + float(error(0, np.array(RESTS[0]))), scale * (RESTS[1] + float(error(1, np.array(RESTS[1]))))
    return passes, (fit_curve(passes, 0, rests[0]), fit_curve(passes, 1, rests[1])), rests


def test_lasers_that_disagree_are_told_and_leave_their_difference_to_the_scale() -> None:
    configuration = BenchConfiguration()
    stated: list[float] = []
    for scale, count in ((1.0, 0), (1.02, 1)):
        passes, curves, rests = curves_of(scale)
        require_agreement(curves)
        one = calibration(
            passes, curves, rests, ("A", "B"), SensorAccuracy(), (RANGE, RANGE), common_linearity=5e-5,
            valid_days=30.0, date=datetime(2026, 5, 4, 12, tzinfo=UTC),
        )  # fmt: skip
        remarks = [
            each
            for each in disagreements(one, curves, fit_reference(passes, 5e-4), configuration)
            if "two lasers" in each
        ]
        assert len(remarks) == count
        stated.append(one.table_uncertainty)
    # one per cent of error of the mean, with k = 2
    assert 0.01 < 2.0 * stated[1] < 0.03
    assert stated[0] < 0.002


def test_an_error_beyond_the_data_sheet_and_a_wrong_sensitivity_are_told() -> None:
    passes, curves, rests = curves_of(1.0)

    def told(curves: tuple[ErrorCurve, ErrorCurve], passes: list[Pass]) -> list[str]:
        one = calibration(
            passes, curves, rests, ("A", "B"), SensorAccuracy(), (RANGE, RANGE), common_linearity=5e-5,
            valid_days=30.0, date=datetime(2026, 5, 4, 12, tzinfo=UTC),
        )  # fmt: skip
        return disagreements(one, curves, fit_reference(passes, 5e-4), BenchConfiguration())

    assert told(curves, passes) == []
    bent = replace(curves[1], error=curves[1].error + np.array([0.0, 0.0, 5e-4, *np.zeros(curves[1].error.size - 3)]))
    (remark,) = told((curves[0], bent), passes)
    assert "linearity error of laser_2" in remark
    (remark,) = told(curves, [replace(each, integrated=each.integrated / 1.03) for each in passes])
    assert "table's acceleration differs by +2.86 %" in remark


@pytest.mark.parametrize("scale", [0.0, 1.06, -1.0])
def test_a_laser_that_does_not_follow_the_table_is_not_calibrated(scale: float) -> None:
    """Aimed at a fixed part, on a wrong range, or inverted."""
    passes, curves, _ = curves_of(1.0)
    noise = np.random.default_rng(4)
    passes = [
        replace(each, lasers=(each.lasers[0], scale * each.lasers[1] + 3e-6 * noise.standard_normal(PHASES.size)))
        for each in passes
    ]
    with pytest.raises((Unmeasurable, InvalidInput)):
        require_agreement((curves[0], fit_curve(passes, 1, 0.0)))


@pytest.mark.parametrize("noise", [0.0, 3e-6])
def test_known_errors_are_found_with_their_delay_and_without_what_the_clamps_yield(noise: float) -> None:
    one = found(noise)
    places = np.linspace(-0.045, 0.045, 91)
    # the standard is the mean of both lasers, and with less weight the accelerometer: what both have in common stays
    smallest = made_pass(8.0, 0.05 * 0.93, np.random.default_rng(1), 0.0).displacement / DISPLACEMENT_SHOWS
    ends = np.array([smallest.min(), smallest.max()])
    spans = [1.0 + float(np.diff(error(k, ends + RESTS[k]))[0] / np.diff(ends)[0]) for k in range(2)]
    share = (one.table_uncertainty / SensorAccuracy().table_scale) ** 2
    lasers, accelerometer = 0.5 * sum(spans) - 1.0, 0.001
    common = (1.0 - share) * lasers + share * accelerometer
    both = [left(one, k, places + RESTS[k]) for k in range(2)]
    for k in range(2):
        assert np.abs(both[k] - common * places).max() < 1.5e-6 + noise
        assert one.lasers[k].delay == pytest.approx(DELAYS[k], abs=2e-6 + noise)
    assert np.abs(both[1] - both[0]).max() < 1.5e-6 + noise
    # four ends of curves that are off by as much as above
    assert one.differential_scale == pytest.approx(spans[1] / spans[0], abs=4.0 * (1.5e-6 + noise) / 0.093)
    assert one.table_displacement * DISPLACEMENT_SHOWS == pytest.approx(1.0 + common, abs=3e-5)
    assert one.table_acceleration == pytest.approx(one.table_displacement * DISPLACEMENT_SHOWS / 1.001, rel=1e-9)
    # what is stated of the scale of the standard: see `test_standards` on where it comes from
    assert 0.001 < one.table_uncertainty < 0.002
    assert abs(common) < 2.0 * one.table_uncertainty


def test_what_is_stated_of_the_curve_is_what_is_left() -> None:
    """Noise that comes anew with each pass; the scatter between passes must foretell the error of what is found."""
    one = found(2e-5)
    places = np.linspace(-0.046, 0.046, 185)
    for k in range(2):
        curve = left(one, k, places + RESTS[k])
        curve -= np.polynomial.Polynomial.fit(places, curve, 1)(places)
        assert 0.3 * one.lasers[k].uncertainty < curve.std() < 2.0 * one.lasers[k].uncertainty


def test_the_linearity_of_the_displacement_sensor_cancels_in_the_scale_of_the_accelerometer() -> None:
    """One and a half waves over the span change it otherwise than the fundamental; the table has harmonics."""
    amplitude, rate, passes, alone = 0.05, 2000.0, list[Pass](), list[float]()
    for omega in (4.0, 8.0):
        phase = omega * np.arange(round(5.2 * 2.0 * np.pi / omega * rate)) / rate
        x = amplitude * (np.sin(phase) + 0.01 * np.sin(3.0 * phase + 0.5))
        values = np.zeros((phase.size, len(SIGNALS) + 1))
        values[:, DISPLACEMENT] = x + 5e-4 * 2.0 * amplitude * np.sin(1.5 * np.pi * x / amplitude)
        values[:, ACCELERATION] = -1.003 * omega**2 * amplitude * (np.sin(phase) + 0.09 * np.sin(3.0 * phase + 0.5))
        values[:, LASER_1] = x
        cycles = CycleAnalyser(omega, rate, 0, HARMONICS).push(values)
        passes.append(mean_pass(cycles, omega))
        displacement, acceleration = np.abs(cycles[0].fundamental[[DISPLACEMENT, ACCELERATION]])
        alone.append(displacement * omega**2 / acceleration)
    assert [each.harmonics for each in passes] == [HARMONICS, HARMONICS]
    # what the calibration states: span of the lasers over that of the sensor, times the ratio
    factor = 1.0 / (1.0 - fit_curve(passes, 0, 0.0).slope)
    assert factor * np.mean([each.ratio for each in passes]) == pytest.approx(1.0 / 1.003, abs=1e-4)
    assert factor * np.mean(alone) != pytest.approx(1.0 / 1.003, abs=2e-4)


def test_few_harmonics_leave_short_waves_to_the_uncertainty() -> None:
    """With few samples per cycle, the order is at its limit, and more of the error remains."""
    places = np.linspace(-0.045, 0.045, 181)

    def short(place: np.ndarray) -> np.ndarray:
        return 1.6e-4 * np.sin(2.0 * np.pi * 5.5 * place / RANGE + 0.7)

    def passes(harmonics: int) -> list[Pass]:
        found: list[Pass] = []
        for k in range(8):
            omega, amplitude = 4.0 if k < 4 else 8.0, 0.05 * (1.0 - 0.01 * k)
            x = amplitude * np.sin(PHASES)
            spectrum = np.fft.rfft(x + short(x))
            spectrum[harmonics + 1 :] = 0.0
            shown = np.fft.irfft(spectrum, x.size)
            found.append(Pass(omega, x, omega * amplitude * np.cos(PHASES), (shown, shown), x, harmonics))
        return found

    for harmonics, largest in ((10, 1e-4), (HARMONICS, 2e-6)):
        curve = fit_curve(passes(harmonics), 0, 0.0)
        readings = places + short(places)
        inside = (2.0 * readings - curve.high - curve.low) / (curve.high - curve.low)
        remaining = (np.polynomial.chebyshev.chebval(inside, curve.error) - short(places)).std()
        assert remaining < min(2.0 * curve.uncertainty, largest)
    assert curve.error.size - 1 > 9


CHANNELS = tuple(
    Channel(name, kind, unit, 1e-6 if unit == "m" else 1e-3, 0.0, (-(2**31), 2**31 - 1), device)
    for name, kind, unit, device in (
        ("table_displacement", "displacement", "m", "lvdt"),
        ("table_acceleration", "acceleration", "m/s2", "servo"),
        ("laser_1", "displacement", "m", "laser A"),
        ("laser_2", "displacement", "m", "laser B"),
    )
)


def test_signals_are_without_the_errors_and_channels_keep_them() -> None:
    """A locked frame under a slow motion has no drift and no u1, whatever the lasers say."""
    one = found()
    x = np.linspace(-0.045, 0.045, 301)
    seen = [RESTS[k] + x for k in range(2)]
    shown = np.column_stack(
        (DISPLACEMENT_SHOWS * x, 1.001 * x, seen[0] + error(0, seen[0]), seen[1] + error(1, seen[1]))
    )
    before = shown.copy()
    raw, right = SignalMap(CHANNELS, "ground"), SignalMap(CHANNELS, "ground", one)
    for signals in (raw, right):
        signals.tare(shown[150:151])
    np.testing.assert_array_equal(shown, before)
    assert np.abs(raw.of(shown)[:, DRIFT]).max() > 1e-4
    assert np.abs(right.of(shown)[:, DRIFT]).max() < 3e-6
    assert np.abs(right.of(shown)[:, U1]).max() < 3e-6
    assert right.of(shown)[:, ACCELERATION] == pytest.approx(one.table_acceleration * 1.001 * x, rel=1e-12, abs=1e-15)
    shown[7, 3] = np.nan
    assert np.isnan(right.of(shown)[7, [LASER_2, DRIFT]]).all()
    assert np.isfinite(right.of(shown)[7, LASER_1])


def test_what_is_left_open_is_less_with_a_calibration_and_no_less_beyond_what_it_covered() -> None:
    def spread(lasers: tuple[float, float], one: LaserCalibration | None) -> dict[str, float]:
        coupled = PeakReadings(0.01, 1.0, lasers, (0.0, 0.0), np.zeros((2, 1)), (0.02, 0.02), True)
        bare = PeakReadings(0.02, 1.0, (0.002, 0.022), (0.0, 0.0), np.zeros((2, 1)), (0.02, 0.02), True)
        doubt = SensorUncertainty(SensorAccuracy(), (RANGE, RANGE), one)
        errors = doubt.drift_errors((bare, coupled), Draws(np.random.default_rng(1), 4000))
        return {name: float(np.std(each[1] / 0.01 - each[0] / 0.02)) for name, each in errors.items()}

    one = found(3e-6)
    within, sheets = spread((0.03, 0.04), one), spread((0.03, 0.04), None)
    assert within[LINEARITY] < 0.4 * sheets[LINEARITY]
    assert within[SCALES] < 0.2 * sheets[SCALES]
    assert spread((0.08, 0.09), one)[LINEARITY] > 3.0 * within[LINEARITY]


def test_a_file_is_read_as_it_was_written_and_is_part_of_the_configuration(tmp_path: Path) -> None:
    one = found()
    write_calibration(tmp_path / "lasers.json", one)
    assert read_calibration(tmp_path / "lasers.json") == one
    bench = tmp_path / "bench.toml"
    bench.write_text('laser_calibration = "lasers.json"\n', encoding="utf-8")
    configuration = read_configuration(bench)
    assert (configuration.calibrated, configuration.laser_calibration) == (one, None)
    assert configuration.sensors.table_scale == one.table_uncertainty
    again = tmp_path / "again.toml"
    again.write_text(as_toml(configuration), encoding="utf-8")
    assert read_configuration(again) == configuration
    with pytest.raises(InvalidInput, match="never overwritten"):
        write_calibration(tmp_path / "lasers.json", one)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "other"}, "it is not a laser calibration"),
        ({"format_version": 9}, "update this program"),
        ({"valid_days": -1.0}, "lasers.json: valid_days"),
        ({"date": "yesterday"}, "lasers.json: date"),
        ({"strange": 1}, "there is no such key"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_its_key(
    change: dict[str, object], words: str, tmp_path: Path
) -> None:
    path = tmp_path / "lasers.json"
    write_calibration(path, found())
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | change), encoding="utf-8")
    with pytest.raises(InvalidInput, match=words):
        read_calibration(path)


def test_age_and_other_lasers_are_told() -> None:
    one = found()
    assert one.expired(one.date + timedelta(days=29)) is None
    said = one.expired(one.date + timedelta(days=31))
    assert said is not None
    assert "2026-06-03" in said
    assert "laser-calibration" in said
    assert one.strange({"laser_1": "laser A", "laser_2": "laser B", "shaker": "x"}) == ()
    (other,) = one.strange({"laser_1": "laser A", "laser_2": "laser C"})
    assert "laser C" in other
    with pytest.raises(ValueError, match="below highest"):
        LaserCurve.model_validate(one.laser_1.model_dump() | {"lowest": 1.0})


@pytest.mark.parametrize(
    ("configuration", "parameters", "item"),
    [
        ("[simulation.bench]\nlaser_1.reference = 'table'\nlaser_2.reference = 'table'\n", {}, "lasers.reference"),
        ("", {"amplitude": 0.059}, "amplitude"),
        ("", {"omega": 14.0}, "omega"),
    ],
)
def test_what_cannot_be_calibrated_is_refused(
    configuration: str, parameters: dict[str, float], item: str, tmp_path: Path
) -> None:
    bench = tmp_path / "bench.toml"
    bench.write_text(configuration, encoding="utf-8")
    with pytest.raises(InvalidInput) as refused:
        PROTOCOL.prepare(LaserCalibrationParameters(**parameters), read_configuration(bench), None)
    assert refused.value.item == item


def test_an_older_calibration_is_not_calibrated_again() -> None:
    with pytest.raises(InvalidInput, match="remove it from the configuration"):
        PROTOCOL.prepare(LaserCalibrationParameters(), BenchConfiguration(calibrated=found()), None)


def test_the_clamps_are_removed_when_a_laser_has_no_reading() -> None:
    plan = PROTOCOL.prepare(LaserCalibrationParameters(), BenchConfiguration(), None).plan()
    asked = list[OperatorTask]()
    blind = tuple(Channel(name, "displacement", "m", 1e-5, 0.0, (-10, 10), "laser") for name in STOREYS)

    def carry_out() -> None:
        step = next(plan)
        while True:
            if isinstance(step, OperatorAction):
                asked.append(step.work)
            at_rest = isinstance(step, AcquireAtRest)
            step = plan.send(RestSamples(blind, np.full((9, 2), 99, np.int16), None) if at_rest else Done())

    with pytest.raises(Unmeasurable, match="no valid reading at rest"):
        carry_out()
    assert asked == [OperatorTask.LOCK_FRAME, OperatorTask.UNLOCK_FRAME]


def simulated_error(laser: int, seed: int, periods: float, place: np.ndarray) -> np.ndarray:
    """Error [m] of a laser of the simulated bench. Its phase is drawn from the bench's seed, and read back here from
    its stream.
    """
    draws = np.random.default_rng(SeedSequence(seed).spawn(7)[3 + laser])
    draws.uniform()
    return 0.0008 * RANGE * np.sin(2.0 * np.pi * periods * place / RANGE + draws.uniform(0.0, 2.0 * np.pi))


def test_a_calibration_on_the_simulated_bench_agrees_with_its_lasers_and_serves_other_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, blocks = tmp_path / "out", tmp_path / "blocks.toml"
    blocks.write_text("[acquisition]\nblock_duration = 0.2\n[simulation.bench]\nsample_rate = 1000.0\n")
    command = ["run", "laser-calibration", "--seed", "5", "--cycles", "4", "--passes", "6", "--config", str(blocks)]
    assert main([*command, "--out", str(out)]) == 0
    one = read_calibration(out / "laser_calibration.json")
    x = np.array([-0.045, 0.045])
    spans = [
        float(np.diff(one.lasers[number].corrected(x + simulated_error(number, 5, 1.5, x)))[0]) / 0.09
        for number in range(2)
    ]
    # three standard uncertainties of a difference, of which both curves and the differential scale are parts
    assert abs(spans[1] - spans[0]) < 3.0 * one.differential_uncertainty
    assert abs(0.5 * sum(spans) - 1.0) < 3.0 * one.table_uncertainty
    with open_datafile(out / "campaign.h5") as record:
        first, second, ratio = record.points[:3]
    assert [first["sensor"], second["sensor"], ratio["sensor"]] == ["laser_1", "laser_2", "laser_2 / laser_1"]
    # both scales are relative to their mean
    assert first["scale_uncertainty"] == second["scale_uncertainty"] == pytest.approx(0.5 * ratio["scale_uncertainty"])
    assert second["scale"] - first["scale"] == pytest.approx(ratio["scale"] - 1.0, rel=1e-2)
    capsys.readouterr()

    old = one.model_copy(update={"date": datetime(2020, 1, 1, tzinfo=UTC)})
    write_calibration(tmp_path / "old.json", old)
    bench = tmp_path / "bench.toml"
    bench.write_text('laser_calibration = "old.json"\n', encoding="utf-8")
    assert main(["run", "identify", "--config", str(bench), "--dry-run", "--json"]) == 0
    (said,) = json.loads(capsys.readouterr().out)["warnings"]
    assert "the laser calibration of 2020-01-01 expired on 2020-12-31" in said


def test_an_error_with_short_waves_is_found_and_the_progress_ends_at_100_percent(tmp_path: Path) -> None:
    """Five and a half periods over the range; ten harmonics of each cycle would leave 21 um of it."""
    out, periods = tmp_path / "out", 5.5
    laser = Laser(linearity_periods=periods)
    bench = VirtualBenchParameters(sample_rate=1000.0, laser_1=laser, laser_2=laser)
    configuration = BenchConfiguration(
        acquisition=Acquisition(block_duration=0.2), simulation=Simulation(bench=bench, seed=5)
    )
    prepared = PROTOCOL.prepare(LaserCalibrationParameters(passes=6, cycles=4), configuration, None)
    result, events = followed(PROTOCOL, prepared, out)
    assert result.status == "completed", result.reason
    ends_at_100_percent(events)
    one = read_calibration(out / "laser_calibration.json")
    for laser, curve in enumerate(one.lasers):
        x = np.linspace(curve.lowest, curve.highest, 401)
        bent = simulated_error(laser, 5, periods, x)
        remaining = curve.corrected(x + bent) - x
        remaining -= np.polynomial.Polynomial.fit(x, remaining, 1)(x)
        assert bent.std() > 1e-4
        assert remaining.std() < min(3.0 * curve.uncertainty, 1e-5)


def test_storeys_that_stay_clamped_are_told() -> None:
    check = load_protocol("check")
    for protocol in (PROTOCOL, check):
        prepared = protocol.prepare(protocol.parameters(), BenchConfiguration(), None)
        plan = prepared.plan()
        step = next(plan)
        while not (isinstance(step, OperatorAction) and step.work is OperatorTask.LOCK_FRAME):
            step = plan.send(Done())
        plan.send(Done())
        plan.close()
        assert "THE STOREYS ARE STILL CLAMPED" in prepared.result([]).text
        # a request that was not confirmed clamps nothing
        declined = protocol.prepare(protocol.parameters(), BenchConfiguration(), None)
        next(plan := declined.plan())
        plan.close()
        assert "CLAMPED" not in declined.result([]).text
