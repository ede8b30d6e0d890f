"""Measurements out of words: whole, counted, timed; damaged ones never."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.errors import ConnectionLost, RigError
from drivers.optoncdt.codec import Decoder
from drivers.optoncdt.frames import Assembler, Frames, Layout, additional_signals, layout_in
from sim.errors import InvalidInput
from tests.drivers.optoncdt.script import measurements

RATE, TICKS = 4000.0, 25
FULL, COUNTED = Layout(4, 1, (2, 3)), Layout(2, 1, None)
LOCK = 9
"""Measurements before the first that is handed out: one without a predecessor, and eight that follow it."""


def fed(assembler: Assembler, chunks: Sequence[bytes]) -> Frames:
    decoder = Decoder()
    parts = [assembler.feed(decoder.feed(chunk)) for chunk in chunks]
    return Frames(
        np.concatenate([part.index for part in parts]),
        np.concatenate([part.time for part in parts]),
        np.concatenate([part.code for part in parts]),
    )


def codes(n: int, seed: int = 1) -> NDArray[np.int32]:
    return np.random.default_rng(seed).integers(0, 65521, n).astype(np.int32)


@pytest.mark.parametrize("layout", [FULL, COUNTED])
@pytest.mark.parametrize("first", [100, 2**18 - 40, 2**32 // TICKS - 40])
@pytest.mark.parametrize("size", [1, 7, 12, 5000])
def test_a_clean_stream_is_whole_over_the_turns_of_counter_and_clock(layout: Layout, first: int, size: int) -> None:
    sent = codes(200)
    data = b"".join(measurements(sent, first, TICKS, clock=layout is FULL))
    assembler = Assembler("laser_1", layout, RATE)
    got = fed(assembler, [data[place : place + size] for place in range(0, len(data), size)])
    np.testing.assert_array_equal(got.code, sent[LOCK:])
    base = got.index[0]
    assert base % 2**18 == (first + LOCK) % 2**18
    np.testing.assert_array_equal(got.index, base + np.arange(200 - LOCK))
    np.testing.assert_allclose(np.diff(got.time), 1.0 / RATE, rtol=1e-6)
    assert assembler.values == 200 - LOCK


def test_time_is_that_of_the_sensors_clock_and_without_it_counted_at_the_nominal_rate() -> None:
    sent = measurements(codes(20), 1000, 26)
    timed = fed(Assembler("laser_1", FULL, RATE), [b"".join(sent)])
    np.testing.assert_allclose(timed.time, timed.index * 26e-5 / 1.0, rtol=1e-12)
    counted = fed(Assembler("laser_1", COUNTED, RATE), [b"".join(measurements(codes(20), 1000, clock=False))])
    np.testing.assert_allclose(counted.time, counted.index / RATE, rtol=1e-12)


def test_unknown_values_between_are_passed_over() -> None:
    from drivers.optoncdt.codec import encode

    data = b"".join(
        encode(code, True) + encode(77, False) + encode(index, False) for index, code in enumerate(codes(30).tolist())
    )
    got = fed(Assembler("laser_1", Layout(3, 2, None), RATE), [data])
    np.testing.assert_array_equal(got.code, codes(30)[got.index])


@given(st.data())
def test_whatever_bytes_are_lost_no_value_stands_at_a_wrong_place(data: st.DataObject) -> None:
    sent = codes(80)
    stream = b"".join(measurements(sent, 0, TICKS))
    keep = np.ones(len(stream), dtype=bool)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(20 * 12, len(stream) - 1))
        keep[start : start + data.draw(st.integers(1, 150))] = False
    # a last measurement whose last bytes are lost is still waiting for them
    received = bytes(np.frombuffer(stream, np.uint8)[keep])
    got = fed(Assembler("laser_1", FULL, RATE), [received])
    np.testing.assert_array_equal(got.code, sent[got.index])
    assert (np.diff(got.index) > 0).all()
    assert (np.diff(got.time) >= 0).all()
    # a burst that ends within a time stamp can set it off by as much as neighbours may differ
    np.testing.assert_allclose(got.time, got.index / RATE, atol=2.1 / RATE)


@given(st.integers(20 * 12, 70 * 12 - 1))
def test_a_lost_byte_costs_its_measurement_and_the_next(place: int) -> None:
    sent = codes(80)
    stream = b"".join(measurements(sent, 0, TICKS))
    assembler = Assembler("laser_1", FULL, RATE)
    got = fed(assembler, [stream[:place] + stream[place + 1 :]])
    missing = sorted(set(range(LOCK, 80)) - set(got.index.tolist()))
    assert missing == [place // 12, place // 12 + 1]
    np.testing.assert_array_equal(got.code, sent[got.index])


@given(st.integers(20 * 12, 70 * 12 - 1), st.integers(0, 5))
def test_a_flipped_bit_in_counter_or_clock_does_not_move_what_follows(place: int, bit: int) -> None:
    assume(place % 12 >= 3)
    sent = codes(80)
    stream = bytearray(b"".join(measurements(sent, 0, TICKS)))
    stream[place] ^= 1 << bit
    got = fed(Assembler("laser_1", FULL, RATE), [bytes(stream)])
    np.testing.assert_array_equal(got.code, sent[got.index])
    np.testing.assert_allclose(got.time, got.index / RATE, atol=2.1 / RATE)
    assert len(got.code) >= 80 - LOCK - 2


@given(st.binary(max_size=400), st.integers(1, 50))
def test_any_bytes_are_survived(data: bytes, size: int) -> None:
    assembler = Assembler("laser_1", FULL, RATE)
    got = fed(assembler, [data[place : place + size] for place in range(0, len(data), size)] or [b""])
    assert got.index.shape == got.time.shape == got.code.shape
    assert assembler.values == got.index.size


def test_a_gap_longer_than_a_turn_of_the_counter_is_bridged_by_the_clock() -> None:
    far = 3 * 2**18 + 1234
    stream = b"".join(measurements(codes(20), 0, TICKS) + measurements(codes(20), far, TICKS))
    assembler = Assembler("laser_1", FULL, RATE)
    got = fed(assembler, [stream])
    assert got.index[-1] == far + 19


@pytest.mark.parametrize("layout", [FULL, COUNTED])
def test_counts_that_begin_anew_are_a_lost_connection(layout: Layout) -> None:
    stream = measurements(codes(50), 900, TICKS, clock=layout is FULL)
    stream += measurements(codes(50), 0, TICKS, clock=layout is FULL)
    with pytest.raises(ConnectionLost, match="laser_1 restarted its counter"):
        fed(Assembler("laser_1", layout, RATE), [b"".join(stream)])


@pytest.mark.parametrize(
    ("rate", "baud", "signals"),
    [
        (4000, 921_600, ("COUNTER", "TIMESTAMP")),
        (8000, 921_600, ("COUNTER",)),
        (8000, 1_000_000, ("COUNTER", "TIMESTAMP")),
        (4000, 460_800, ("COUNTER",)),
        (1000, 115_200, ("COUNTER",)),
        (250, 115_200, ("COUNTER", "TIMESTAMP")),
        (80, 9_600, ("COUNTER", "TIMESTAMP")),
    ],
)
def test_as_much_is_asked_for_as_the_line_carries(rate: float, baud: int, signals: tuple[str, ...]) -> None:
    assert additional_signals(rate, baud) == signals


def test_a_rate_that_the_line_does_not_carry_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"115200 baud allows at most 1920 measurements/s .* higher baud rate"):
        additional_signals(4000, 115_200)


@pytest.mark.parametrize(
    ("reported", "layout"),
    [
        (["DIST1", "COUNTER", "TIMESTAMP"], Layout(4, 1, (2, 3))),
        (["DIST1", "TIMESTAMP", "COUNTER"], Layout(4, 3, (1, 2))),
        (["DIST1", "TIMESTAMP_HI", "TIMESTAMP_LO", "STATE", "COUNTER"], Layout(5, 4, (2, 1))),
        (["DIST", "INTENSITY", "COUNTER", "TIMESTAMP"], Layout(5, 2, (3, 4))),
    ],
)
def test_the_order_is_the_one_that_the_sensor_reports(reported: list[str], layout: Layout) -> None:
    assert layout_in("laser_1", reported, ("COUNTER", "TIMESTAMP")) == layout


@pytest.mark.parametrize("reported", [[], ["DIST1"], ["COUNTER", "DIST1", "TIMESTAMP"], ["DIST1", "COUNTER"]])
def test_another_order_than_was_asked_for_is_refused(reported: list[str]) -> None:
    with pytest.raises(RigError, match=r"laser_1 sends .* instead of distance, counter, timestamp"):
        layout_in("laser_1", reported, ("COUNTER", "TIMESTAMP"))
