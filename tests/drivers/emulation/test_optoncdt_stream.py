"""What the emulated sensor measures and sends, at instants that the test makes up."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.emulation.optoncdt.evaluation import Fault
from drivers.emulation.optoncdt.sensor import TICKS, Grid
from sim.sensors import Laser
from tests.drivers.emulation.optoncdt_client import PERFECT, Bare, Seen, blocks, metres, still

HALF_A_STEP = 0.5 * 1.02 * 0.2 / 65520.0
"""Half of the least step of the digital output at a measuring range of 0.2 m [m]."""
FLOATING = 1e-9
"""What arithmetic may leave [m]."""


def ramp(speed: float) -> Seen:
    """Passes mid range at the instant 100 s."""
    return Seen(lambda times: speed * (times - 100.0))


@pytest.mark.parametrize("place", [-0.1, -0.031, 0.0, 0.05, 0.1])
def test_a_distance_is_the_manuals(place: float) -> None:
    code = Bare(still(place)).stream(0.1)[-1, 0]
    assert metres(code) == pytest.approx(0.1 + place, abs=HALF_A_STEP + FLOATING)


@pytest.mark.parametrize(("rate", "error"), [(4000.0, 30e-6), (1000.0, -5e-3), (8000.0, 9e-3)])
def test_the_rate_is_that_of_the_sensors_clock(rate: float, error: float) -> None:
    sent = Bare(rate=rate, clock_error=error).stream(4.0)
    assert len(sent) == pytest.approx(4.0 * rate * (1.0 + error), abs=5)


@given(st.lists(st.floats(1e-4, 0.05), min_size=1, max_size=30))
@settings(deadline=None)
def test_what_is_sent_does_not_depend_on_when_the_line_is_served(turns: list[float]) -> None:
    often, once = (Bare(ramp(0.01), Laser(), additional=("COUNTER",), average=8, hold=3.0) for _ in range(2))
    pieces = b"".join(often.raw(turn, turn) for turn in turns)
    # the last instant is a sum, so that a block more or less may be due
    whole = once.raw(sum(turns), sum(turns))
    both = min(len(pieces), len(whole))
    assert abs(len(pieces) - len(whole)) <= 6
    assert pieces[:both] == whole[:both]


def test_a_measurement_leaves_the_sensor_three_cycles_after_its_exposure() -> None:
    bare = Bare(ramp(0.1), rate=1000.0)
    delays: list[float] = []
    while len(delays) < 50:
        for code in bare.stream(1e-4, turn=1e-4)[:, 0]:
            exposed = 100.0 + (metres(code) - 0.1) / 0.1
            delays.append(bare.now - exposed)
    # three cycles, the time of a value on the line (33 us), and up to a turn of this test
    assert min(delays) > 0.003
    assert max(delays) < 0.0032


def test_counter_and_time_stamp_belong_to_the_exposure() -> None:
    error = 4e-3
    bare = Bare(ramp(0.06), additional=("COUNTER", "TIMESTAMP"), clock_error=error)
    bare.now += 0.5
    bare.sensor.stream(bare.now)
    assert bare.say("RESETCNT TIMESTAMP MEASCNT") == "->"
    zero = bare.now
    sent = bare.stream(1.0, 4)
    sent = sent[np.argmax(sent[:, 1] == 0) :]
    n = np.arange(len(sent))
    stamps = sent[:, 2] + 65536 * sent[:, 3]
    assert (sent[:, 1] == n).all()
    # 4 kHz and 10 us are both of the sensor's clock: 25 ticks a measurement, whatever its error
    assert (stamps - stamps[0] - 25 * n <= 1).all()
    assert (stamps - stamps[0] - 25 * n >= -1).all()
    seen_at = 100.0 + (np.array([metres(code) for code in sent[:, 0]]) - 0.1) / 0.06
    assert zero + stamps * 1e-5 / (1.0 + error) == pytest.approx(seen_at, abs=4e-5)


def test_what_was_exposed_before_a_reset_keeps_its_count() -> None:
    bare = Bare(additional=("COUNTER",))
    before = bare.stream(1.0, 2)[-1, 1]
    bare.say("RESETCNT MEASCNT")
    after = bare.stream(0.01, 2)[:, 1]
    start = int(np.argmax(after == 0))
    assert 0 < start <= 5
    assert (after[:start] == before + 1 + np.arange(start)).all()


def test_the_counter_has_18_bits_and_the_time_stamp_32() -> None:
    bare = Bare(additional=("COUNTER", "TIMESTAMP"))
    bare.say("RESETCNT")
    bare.say("OUTPUT NONE")
    bare.now += 2**18 / 4000.0 - 0.1
    bare.sensor.stream(bare.now)
    bare.say("OUTPUT RS422")
    counters = bare.stream(0.2, 4)[:, 1]
    assert counters.max() == 2**18 - 1
    assert counters.min() == 0
    bare.say("OUTPUT NONE")
    bare.now = bare.sensor.grid.epoch.now + 2**32 * 1e-5 - 0.01
    bare.sensor.stream(bare.now)
    bare.say("OUTPUT RS422")
    assert set(bare.stream(0.1, 4)[:, 3]) == {65535, 0}


def test_a_machine_that_stood_still_has_lost_values() -> None:
    bare = Bare(additional=("COUNTER",))
    before = bare.stream(0.1, 2)[-1, 1]
    bare.now += 3600.0
    after = bare.stream(0.1, 2)[:, 1]
    assert len(after) < 11 * 4000
    assert (after[-1] - before) % 2**18 == pytest.approx(3600.1 * 4000.0 % 2**18, abs=20)


def test_additional_values_come_in_the_order_of_the_sensor() -> None:
    bare = Bare(still(0.05), rate=2000.0)
    assert bare.say("OUTADD_RS422 STATE TIMESTAMP SHUTTER DIST_RAW INTENSITY COUNTER") == "->"
    assert bare.say("GETOUTINFO_RS422") == (
        "GETOUTINFO_RS422 DIST1 SHUTTER COUNTER TIMESTAMP INTENSITY STATE DIST_RAW\r\n->"
    )
    block = bare.stream(0.1, 8)[-1]
    assert metres(block[0]) == pytest.approx(0.15, abs=2 * HALF_A_STEP)
    assert 1 <= block[1] <= 500 * 10
    assert 0.0 < block[5] * 25 / 16368 <= 100.0
    assert block[6] == 1 << 16
    assert block[7] * 100 / 262143 == pytest.approx(75.0, abs=0.01)


@pytest.mark.parametrize(
    ("place", "code", "bit"),
    [(-0.1021, 262077, 5), (0.1021, 262078, 6), (nan, 262076, 2), (-0.1019, 0, None), (0.1019, 65520, None)],
)
def test_beyond_the_reserve_there_is_an_error(place: float, code: int, bit: int | None) -> None:
    distance, state = Bare(still(place), additional=("STATE",)).stream(0.1, 2)[-1]
    assert distance == pytest.approx(code, abs=0 if bit is not None else 40)
    assert state & 0x64 == (0 if bit is None else 1 << bit)


def test_a_laser_that_is_off_says_so() -> None:
    bare = Bare()
    bare.say("LASERPOW OFF")
    assert set(bare.stream(0.1)[5:, 0]) == {262082}
    bare.say("LASERPOW FULL")
    assert set(bare.stream(0.1)[5:, 0]) == {32760}


@pytest.mark.parametrize(
    ("baud", "rate", "additional", "reduction", "fits"),
    [
        (921600, 4000.0, ("SHUTTER", "COUNTER", "TIMESTAMP", "INTENSITY", "STATE"), 1, True),
        (921600, 4000.0, ("SHUTTER", "COUNTER", "TIMESTAMP", "INTENSITY", "STATE", "DIST_RAW"), 1, False),
        (921600, 8000.0, ("COUNTER", "INTENSITY"), 1, True),
        (921600, 8000.0, ("COUNTER", "TIMESTAMP"), 1, False),
        (115200, 4000.0, (), 1, False),
        (115200, 4000.0, (), 2, True),
        (9600, 250.0, (), 1, True),
        (9600, 500.0, (), 1, False),
    ],
)
def test_a_line_that_is_too_slow_carries_an_error(
    baud: int, rate: float, additional: tuple[str, ...], reduction: int, fits: bool
) -> None:
    # values that fit in a second: baud rate over 30 bits
    bare = Bare(baud=baud, rate=rate, additional=additional, reduction=reduction)
    size = 1 + len(additional) + ("TIMESTAMP" in additional)
    raw = bare.raw(2.0)
    assert set(blocks(raw, size)[:, 0]) == {32760 if fits else 262075}
    assert len(raw) * 10 <= 2.0 * baud


def test_reduction_sends_every_nth_measurement() -> None:
    bare = Bare(additional=("COUNTER",))
    bare.say("OUTREDUCECOUNT 10")
    assert set(np.diff(bare.stream(1.0, 2)[:, 1])) == {10}
    bare.say("OUTREDUCEDEVICE NONE")
    assert set(np.diff(bare.stream(1.0, 2)[1:, 1])) == {1}


@pytest.mark.parametrize(("hold", "held"), [("NONE", 0), ("7", 7), ("1024", 40), ("INFINITE", 40)])
def test_hold_repeats_the_last_valid_value(hold: str, held: int) -> None:
    bare = Bare(still(0.01), rate=1000.0)
    bare.say(f"OUTHOLD {hold}")
    valid = bare.stream(0.1)[-1, 0]
    bare.sensor.target = Fault.TOO_FAR
    sent = bare.stream(0.04)[:, 0]
    assert (sent[:held] == valid).all()
    assert (sent[held:] == 262078).all()
    bare.sensor.target = None
    assert bare.stream(0.04)[-1, 0] == valid


def test_hold_has_nothing_to_repeat_before_the_first_valid_value() -> None:
    assert set(Bare(still(nan), hold=inf).stream(0.1)[:, 0]) == {262076}


@pytest.mark.parametrize("n", [2, 16, 128])
def test_a_moving_mean_delays_by_half_its_length(n: int) -> None:
    plain, mean = (Bare(ramp(0.05), rate=1000.0) for _ in range(2))
    mean.say(f"AVERAGE MOVING {n}")
    late = np.array([metres(a) - metres(b) for a, b in zip(plain.stream(1.0), mean.stream(1.0), strict=True)])
    assert late[n:, 0] == pytest.approx(0.05 * 0.5 * (n - 1) / 1000.0, abs=3 * HALF_A_STEP)


def test_a_moving_mean_leaves_errors_out() -> None:
    bare = Bare(still(0.02), average=8)
    valid = bare.stream(0.1)[-1, 0]
    bare.sensor.target = Fault.NO_PEAK
    bare.stream(0.001)
    bare.sensor.target = None
    assert set(bare.stream(0.1)[:, 0]) == {valid}


def test_errors_of_the_optics_are_those_of_the_simulated_laser() -> None:
    scaled = PERFECT.model_copy(update={"scale_error": 0.01})
    assert metres(Bare(still(0.05), scaled).stream(0.01)[-1, 0]) == pytest.approx(0.1505, abs=2 * HALF_A_STEP)
    noisy = PERFECT.model_copy(update={"noise": 50e-6})
    spread = np.std([metres(code) for code in Bare(still(0.0), noisy).stream(2.0)[:, 0]])
    assert spread == pytest.approx(50e-6, rel=0.05)
    # over one and a half waves within the range the linearity error runs through its whole amplitude
    bent = PERFECT.model_copy(update={"linearity": 0.001})
    swept = Bare(Seen(lambda times: 0.1 * np.sin(2.0 * np.pi * (times - 100.0))), bent).stream(1.0)[:, 0]
    straight = Bare(Seen(lambda times: 0.1 * np.sin(2.0 * np.pi * (times - 100.0)))).stream(1.0)[:, 0]
    error = np.array([metres(a) - metres(b) for a, b in zip(swept, straight, strict=True)])
    assert error.max() == pytest.approx(0.0002, rel=0.02)
    assert error.min() == pytest.approx(-0.0002, rel=0.02)


def test_the_stamps_of_all_exposures_are_early_by_the_same_part_of_a_tick() -> None:
    grid = Grid(4000.0, 30e-6, 0.123456)
    grid.epoch.reset(5.0004321)
    times = grid.times(np.arange(21_000, 22_000))
    early = (times - 5.0004321) * (1.0 + 30e-6) - grid.stamps(times) / TICKS
    np.testing.assert_allclose(early, grid.stamp_lag, atol=1e-9)
    assert 0.0 < grid.stamp_lag < 1.0 / TICKS
