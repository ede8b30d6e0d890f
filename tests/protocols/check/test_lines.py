"""The lines of the check from made-up signals whose truth is known."""

from dataclasses import fields, replace

import numpy as np
import pytest

from bench.analysis.check_line import CheckLine, Verdict
from bench.analysis.gain import COVERAGE, SensorAccuracy
from bench.config.model import BenchConfiguration
from bench.engine.steps import RestSamples
from drivers.hardware.parameters import Hardware, Lasers
from drivers.optoncdt.codec import IMPLAUSIBLE, LATE, LOST, MEANINGS
from drivers.rig import Alignment, Channel
from protocols.check.comparison import allowed_delay, delay_lines, scale_lines, signed_scale, table_delay_lines
from protocols.check.held_readings import Windows
from protocols.check.lines import alignment_lines, dead_time, drive_lines, input_lines, resting_lines
from protocols.check.protocol import CheckParameters
from protocols.check.sines import LaserDelays, Sines, delay_between, held_for, laser_delays
from sim.specimen import Frame, Specimen

OMEGA = np.array([8.0, 12.0, 18.0, 27.0, 40.0])
PARAMETERS = CheckParameters()
SERIAL = BenchConfiguration(backend="hardware", hardware=Hardware(lasers=Lasers(delay=0.002)))


def late(amplitudes: np.ndarray, delay: float) -> np.ndarray:
    """The complex amplitudes of the same signal `delay` later: Re(c exp(-i omega (t - d)))."""
    return amplitudes * np.exp(1j * OMEGA * delay)


def sines(**changed: np.ndarray) -> Sines:
    """Four sensors that agree about 60 mm/s, with some signals changed."""
    x = (0.06 / OMEGA) * np.exp(0.7j)
    signals = {"drive": x, "acceleration": -(OMEGA**2) * x, "displacement": x, "storey_1": x, "storey_2": x}
    return Sines(omega=OMEGA, **(signals | changed))


def laser_lines(made: Sines, configuration: BenchConfiguration) -> list[CheckLine]:
    lasers = against(made, "displacement", held_for(configuration))
    return list(delay_lines(made, lasers, PARAMETERS, configuration))


def against(made: Sines, table: str, timing: float = 0.0) -> LaserDelays:
    """Each sine in eight cycles, without noise and as if the ages of the readings were all the same."""
    parts = Sines(**{each.name: np.repeat(getattr(made, each.name), 8) for each in fields(made)})
    length = 2.0 * np.pi / parts.omega
    return laser_delays(parts, Windows(np.cumsum(length) - length, length), table, timing, 2000.0)


def failures(lines: list[CheckLine]) -> list[tuple[str, str]]:
    return [(line.subject, line.what) for line in lines if line.verdict is Verdict.FAILED]


def scales(made: Sines) -> list[CheckLine]:
    return list(scale_lines(made, PARAMETERS, lasers=True))


def test_sensors_that_agree_pass() -> None:
    assert failures(scales(sines())) == []
    assert len(scales(sines())) == 7


@pytest.mark.parametrize(
    ("signal", "subject", "reference"),
    [
        ("acceleration", "table_acceleration", "table_displacement"),
        ("displacement", "table_displacement", "table_acceleration"),
        ("storey_1", "laser_1", "table_displacement"),
        ("storey_2", "laser_2", "table_displacement"),
    ],
)
def test_the_sensor_that_contradicts_the_others_is_named(signal: str, subject: str, reference: str) -> None:
    true = getattr(sines(), signal)
    assert failures(scales(sines(**{signal: -true}))) == [(subject, f"polarity against {reference}")]
    off = failures(scales(sines(**{signal: 1.03 * true})))
    assert off[0] == (subject, f"scale against {reference}")
    assert set(off[1:]) <= {("lasers", "scale of laser_2 against laser_1")}


def test_a_clamp_that_gives_way_changes_no_scale() -> None:
    """Ahead of its resonance at omega_c a storey moves by 1 / (1 - (omega / omega_c)^2) times the table."""
    given = sines().displacement / (1.0 - (OMEGA / 200.0) ** 2)
    scale, uncertainty = signed_scale(OMEGA, given, sines().displacement)
    assert scale == pytest.approx(1.0, abs=1e-3)
    assert uncertainty < 1e-3


def test_the_intervals_of_delays_and_scales_cover_95_percent() -> None:
    """Equal noise of both displacements: five frequencies leave four degrees of freedom to a delay, three to a scale.

    Twice the scatter alone would cover 88 and 92 %, and of 2000 intervals 93 % are covered with a probability of 0.999.
    """
    random, n = np.random.default_rng(6), 2000
    noise = 1e-6 * (random.standard_normal((n, 2, 5)) + 1j * random.standard_normal((n, 2, 5)))
    pairs = sines().displacement + noise
    delays = [delay_between(OMEGA, first, second) for first, second in pairs]
    inside = [abs(one.delay) <= COVERAGE * one.uncertainty for one in delays]
    assert 0.93 < np.mean(inside) < 0.985
    scales = [signed_scale(OMEGA, second, first) for first, second in pairs]
    assert 0.93 < np.mean([abs(scale - 1.0) <= COVERAGE * u for scale, u in scales]) < 0.99


def test_readings_of_serial_lasers_have_no_age() -> None:
    assert held_for(BenchConfiguration()) == BenchConfiguration().analysis.laser_timing
    assert held_for(SERIAL) == 0.0
    assert held_for(ANALOGUE) == ANALOGUE.analysis.laser_timing


def test_without_lasers_only_the_table_is_compared() -> None:
    lines = list(scale_lines(sines(storey_1=np.zeros(5) + 0j), PARAMETERS, lasers=False))
    assert {line.subject for line in lines} == {"table_acceleration"}


def test_a_delay_is_measured_and_the_setting_takes_it_away() -> None:
    x = sines().displacement
    lines = laser_lines(sines(storey_1=late(x, 0.003), storey_2=late(x, 0.0028)), SERIAL)
    first, second, difference, setting = lines
    assert (first.measured, second.measured) == (pytest.approx(0.003, abs=1e-9), pytest.approx(0.0028, abs=1e-9))
    assert difference.measured == pytest.approx(-0.0002, abs=1e-9)
    assert failures(lines) == [(f"laser_{k}", "delay against table_displacement") for k in (1, 2)]
    assert setting.verdict is Verdict.STATED
    # 2 ms are configured; the lasers are still 2.9 ms late, so they must be placed 2.9 ms earlier
    assert setting.measured == pytest.approx(0.002 - 0.0029, abs=1e-9)


@pytest.mark.parametrize("delay", [11e-6, 4.4e-4, -1.9e-4, 4.6e-4, -2.1e-4, 8e-3, 20e-3, -20e-3])
def test_the_delay_between_the_sensors_of_the_table_is_measured(delay: float) -> None:
    made = sines(acceleration=late(sines().acceleration, delay))
    line, *rest = table_delay_lines(made, PARAMETERS, 2000.0)
    assert line.measured == pytest.approx(delay, abs=1e-9)
    assert (line.subject, line.what) == ("table_acceleration", "delay against table_displacement")
    assert line.verdict is (Verdict.PASSED if -2e-4 < delay < 4.5e-4 else Verdict.FAILED)
    assert rest == []


@pytest.mark.parametrize(
    ("changed", "odd"), [("acceleration", "table_acceleration"), ("displacement", "table_displacement")]
)
def test_the_sensor_that_differs_from_the_lasers_is_named(changed: str, odd: str) -> None:
    x = sines().displacement
    # lasers with a latency of their own
    latency = {"storey_1": late(x, 6e-4), "storey_2": late(x, 6e-4)}
    made = sines(**latency, **{changed: late(getattr(sines(), changed), 8e-3)})
    line, *pairs = table_delay_lines(made, PARAMETERS, 2000.0, lasers=against(made, "accelerometer"))
    assert f"{odd} differs from the lasers" in line.remedy
    assert "different times" in line.remedy
    assert [(pair.subject, pair.what) for pair in pairs] == [
        (name, "delay against table_acceleration") for name in ("laser_1", "laser_2")
    ]


def test_known_and_unknown_delays_of_inputs_are_told() -> None:
    given = (
        replace(CHANNELS[0], delay=0.02, delay_uncertainty=1e-6),
        replace(CHANNELS[1], delay_uncertainty=np.inf),
        CHANNELS[2],
    )
    known, unknown = input_lines(given)
    assert (known.subject, known.measured, known.uncertainty) == ("table_displacement", 0.02, 2e-6)
    assert (unknown.subject, unknown.verdict) == ("laser_1", Verdict.UNTESTED)


def test_where_no_delay_can_be_set_none_is_stated() -> None:
    lines = laser_lines(sines(), BenchConfiguration())
    assert [line.verdict for line in lines] == 3 * [Verdict.PASSED]


def test_lasers_that_differ_in_delay_fail_on_their_difference() -> None:
    x = sines().displacement
    lines = laser_lines(sines(storey_1=late(x, -3.5e-4), storey_2=late(x, 3.5e-4)), BenchConfiguration())
    assert failures(lines) == [("lasers", "delay of laser_2 against laser_1")]


ANALOGUE = BenchConfiguration(backend="hardware", hardware=Hardware(lasers=Lasers(connection="analogue")))


@pytest.mark.parametrize(
    ("configuration", "delays", "remedies"),
    [
        (SERIAL, (2e-3, 2e-3), ("set hardware.lasers.delay", "set hardware.lasers.delay")),
        (SERIAL, (-2e-3, -2e-3), ("set hardware.lasers.delay", "set hardware.lasers.delay")),
        # the mean of both would leave one ahead and one behind
        (SERIAL, (0.0, 6e-3), ("", "the lasers differ in delay")),
        (ANALOGUE, (2e-3, -2e-3), ("internal latency is too long", "the laser is ahead of the table's sensor")),
    ],
)
def test_the_remedy_for_the_delay_of_a_laser_fits_its_cause(
    configuration: BenchConfiguration, delays: tuple[float, float], remedies: tuple[str, str]
) -> None:
    x = sines().displacement
    made = sines(storey_1=late(x, delays[0]), storey_2=late(x, delays[1]))
    for line, remedy in zip(laser_lines(made, configuration), remedies, strict=False):
        assert remedy in line.remedy
        assert bool(remedy) is (line.verdict is Verdict.FAILED)


@pytest.mark.parametrize("configuration", [SERIAL, ANALOGUE])
def test_a_late_sensor_of_the_table_is_not_blamed_on_the_lasers(configuration: BenchConfiguration) -> None:
    """A table sensor behind a filter of 20 ms: a delay of the lasers set against it would make their values wrong."""
    lines = laser_lines(sines(displacement=late(sines().displacement, 0.02)), configuration)
    assert failures(lines) == [(f"laser_{k}", "delay against table_displacement") for k in (1, 2)]
    for line in lines[:2]:
        assert "the table's sensors differ in delay" in line.remedy
    assert len(lines) == 3


def test_the_allowed_delay_of_a_single_mass_is_its_closed_form() -> None:
    """A second storey tied rigidly to the first: u1 = x r^2 / (1 - r^2), so |u1 + x| / |u1| = 1 / r^2."""
    frame = Frame(k2=1e9, xi1=0.0, xi2=0.0)
    ratio = 20.0**2 * (frame.m1 + frame.m2) / frame.k1
    assert allowed_delay(Specimen(frame=frame), 20.0, 0.01) == pytest.approx(0.01 * ratio / 20.0, rel=1e-5)


@pytest.mark.parametrize("time", [-0.003, 0.0, 0.0046, 0.018])
def test_the_dead_time_is_told_from_mass_dashpot_and_spring(time: float) -> None:
    """exp(+i omega t) convention: a / drive = G s^2 / (m s^2 + c s + k) exp(-s T)."""
    s = 1j * OMEGA
    response = 187.5 * s**2 / (52.0 * s**2 + 3155.0 * s + 500.0) * np.exp(-s * time)
    drive = np.ones(5) + 0j
    # a cycle's amplitudes belong to exp(-i omega t)
    assert dead_time(OMEGA, drive, np.conj(response), 0.02) == pytest.approx(time, abs=1.5e-5)


def test_inputs_ahead_of_the_drive_fail() -> None:
    early = sines(drive=late(sines().acceleration, 0.004))
    lines = list(drive_lines(early, PARAMETERS, SERIAL))
    assert failures(lines) == [("drive", "dead time to table_acceleration")]
    assert [line.verdict for line in lines[1:]] == 5 * [Verdict.STATED]


CHANNELS = (
    Channel("table_displacement", "displacement", "m", 1e-5, 0.0, (-8000, 8000), "made up"),
    Channel("laser_1", "displacement", "m", 1e-5, 0.0, (-8000, 8000), "made up", faults={8191: "no target"}),
    Channel("coil_current", "current", "A", 1e-3, 0.0, (-8000, 8000), "made up"),
)


def rest(**columns: np.ndarray) -> list[CheckLine]:
    noise = np.random.default_rng(5).integers(-2, 3, 1000)
    counts = np.column_stack([columns.get(channel.name, noise) for channel in CHANNELS]).astype(np.int16)
    return list(resting_lines(RestSamples(CHANNELS, counts, None), PARAMETERS, SensorAccuracy()))


def test_quiet_living_channels_pass_and_others_are_stated() -> None:
    lines = rest()
    assert failures(lines) == []
    assert [(line.subject, line.what) for line in lines if line.verdict is Verdict.STATED] == [
        ("coil_current", "noise at rest")
    ]
    # uniform on -2 .. 2: a standard deviation of the square root of 2
    assert lines[1].measured == pytest.approx(np.sqrt(2.0) * 1e-5, rel=0.1)


def test_a_fault_is_said_in_the_sensors_words() -> None:
    lines = rest(laser_1=np.full(1000, 8191))
    assert failures(lines) == [("laser_1", "valid samples at rest")]
    assert "no target" in next(line.remedy for line in lines if line.verdict is Verdict.FAILED)


@pytest.mark.parametrize(
    ("mark", "words"),
    [(LATE, "the computer was busy, or the sensor is silent"), (LOST, "check the cable"), (IMPLAUSIBLE, "shield")],
)
def test_values_that_did_not_arrive_are_not_blamed_on_the_target(mark: int, words: str) -> None:
    laser = Channel("laser_1", "displacement", "m", 3e-6, 0.0, (-32760, 32760), "made up", faults=MEANINGS)
    counts = np.full((1000, 1), mark, np.int16)
    line, *_ = resting_lines(RestSamples((laser,), counts, None), PARAMETERS, SensorAccuracy())
    assert line.verdict is Verdict.FAILED
    assert words in line.remedy
    assert "storey" not in line.remedy


@pytest.mark.parametrize(("count", "end"), [(-8192, "lower"), (8191, "upper")])
def test_a_channel_at_its_rail_fails(count: int, end: str) -> None:
    lines = rest(table_displacement=np.full(1000, count))
    assert failures(lines) == [("table_displacement", "valid samples at rest")]
    assert f"beyond the {end} end of its range" in next(line.remedy for line in lines if line.remedy)


@pytest.mark.parametrize("name", ["table_displacement", "coil_current"])
def test_a_channel_that_never_changes_fails(name: str) -> None:
    assert failures(rest(**{name: np.full(1000, 17)})) == [(name, "noise at rest")]


def test_a_loud_channel_fails() -> None:
    loud = np.random.default_rng(1).integers(-40, 41, 1000)
    assert failures(rest(table_displacement=loud)) == [("table_displacement", "noise at rest")]


def test_the_alignment_is_stated_with_its_method() -> None:
    watched = Alignment("laser_1", 0.1, 1.0, 40e-6, 3e-3, 4000, 0)
    configuration = BenchConfiguration()
    lines = list(alignment_lines([watched, replace(watched, sensor="laser_2", mark_uncertainty=3e-6)], configuration))
    assert [line.subject for line in lines] == ["laser_1", "laser_1", "laser_2", "laser_2"]
    assert lines[0].what.startswith("alignment from arrival times")
    assert lines[0].measured == 40e-6
    assert lines[2].what.startswith("alignment by pulses")
    assert (lines[2].measured, lines[2].expected) == (3e-6, pytest.approx(1.75e-6))
    assert lines[1].measured == lines[3].measured == 3e-3
