"""A sensor that streams: what arrives is handed out whole, and nothing is when it must not be."""

import threading
import time
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.clock import now
from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from drivers.optoncdt.codec import LASER_OFF, encode, marked
from drivers.optoncdt.sensor import SerialLaser
from drivers.optoncdt.stream import Readings
from sim.errors import InvalidInput
from tests.drivers.optoncdt.peer import Peer, no_thread_left
from tests.drivers.optoncdt.script import INFO, OPENED, STARTED, STOPPED, Script, joined, measurements
from tests.patience import LONG

CODES = np.random.default_rng(5).integers(0, 65521, 4000).astype(np.int32)
LOCK = 9
"""Measurements before the first that is handed out."""


def streaming(n: int, codes: NDArray[np.int32] = CODES) -> Script:
    """Opened and started; the first `n` measurements come with the last answer."""
    *before, (command, answer) = STARTED
    return [*OPENED, *before, (command, answer + b"".join(measurements(codes[:n], 1)))]


def opened(peer: Peer) -> SerialLaser:
    return SerialLaser("laser_1", peer.path, baud=921_600, rate=4000.0, measuring_range=0.2)


def eventually(laser: SerialLaser, n: int) -> Readings:
    """Take until there are `n` readings."""
    taken: list[Readings] = []
    deadline = time.monotonic() + LONG
    while sum(len(one) for one in taken) < n:
        assert time.monotonic() < deadline
        laser.wait(0.1)
        taken.append(laser.take())
    return joined(taken)


def until(happened: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LONG
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_everything_is_handed_out_once_with_its_place_and_time() -> None:
    begun = now()
    with no_thread_left(), Peer([*streaming(30), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        sent = measurements(CODES[30:], 31)
        for place in range(0, len(sent), 100):
            peer.send(b"".join(sent[place : place + 100]))
        got = eventually(laser, 4000 - LOCK)
        np.testing.assert_array_equal(got.code, CODES[LOCK:])
        np.testing.assert_array_equal(got.index, np.arange(LOCK + 1, 4001))
        np.testing.assert_allclose(got.time, got.index / 4000.0, rtol=1e-12)
        assert (np.diff(got.arrival) >= 0).all()
        assert begun < got.arrival[0] <= got.arrival[-1] <= now()
        assert len(laser.take()) == 0


def test_lost_bytes_are_counted_and_never_make_a_value() -> None:
    with Peer([*streaming(100), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        sent = b"".join(measurements(CODES[100:], 101))
        peer.send(sent[:5000] + sent[5001:20_000] + sent[20_700:])
        # the byte costs its measurement and the next; of the burst's 700 bytes parts of 60 measurements are gone
        got = eventually(laser, 4000 - LOCK - 2 - 61)
        np.testing.assert_array_equal(got.code, CODES[got.index - 1])
        assert got.index[-1] == 4000
        assert 2 + 59 <= 4000 - LOCK - len(got) <= 2 + 61


def test_error_words_come_through_as_they_are() -> None:
    codes = np.full(50, 262082, dtype=np.int32)
    with Peer([*streaming(50, codes), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        got = eventually(laser, 50 - LOCK)
        assert set(got.code.tolist()) == {262082}
        assert set(marked(got.code).tolist()) == {LASER_OFF}


@pytest.mark.parametrize("answer", [b"->", b"->" + b"".join(measurements(CODES[:300], 1, clock=False))])
def test_a_stream_that_is_not_as_said_is_refused(answer: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.optoncdt.sensor._LOCK_TIME", 0.2)
    with no_thread_left(), Peer([*OPENED, STARTED[0], (b"OUTPUT RS422", answer), *STOPPED]) as peer:
        laser = opened(peer)
        with pytest.raises(DeviceTimeout, match="sends no consecutive measurements at 4000/s"):
            laser.start()
        laser.close()


def test_a_sensor_that_says_nothing_for_long_is_silent() -> None:
    with Peer([*streaming(30), *STOPPED]) as peer, opened(peer) as laser:
        assert laser.silent
        laser.start()
        until(lambda: laser.silent)
        peer.send(b"".join(measurements(CODES[30:50], 31)))
        until(lambda: not laser.silent)
        laser.stop()
        assert laser.silent


def test_waiting_ends_with_a_value_or_in_time() -> None:
    with Peer([*streaming(30), *STOPPED]) as peer, opened(peer) as laser:
        assert not laser.wait(0.0)
        laser.start()
        assert laser.wait(0.0)
        eventually(laser, 30 - LOCK)
        assert not laser.wait(0.01)
        peer.send(b"".join(measurements(CODES[30:32], 31)))
        assert laser.wait(LONG)


def without_queries(script: Script) -> Script:
    """The script of a sensor that has the documented commands only."""
    unknown = b"E210 Unknown command\r\n->"
    answered: list[tuple[bytes, bytes]] = []
    for command, answer in script:
        answered.append((command, unknown if command in (b"MASTERMV", b"MEASRATE") else answer))
        if command == b"MASTERMV":
            answered.append((b"MASTERMV NONE", b"->"))
    return answered


@pytest.mark.milliseconds
@pytest.mark.parametrize(("sent", "refused"), [(4000, False), (2000, True)])
def test_the_rate_is_counted_where_the_sensor_does_not_report_it(
    monkeypatch: pytest.MonkeyPatch, sent: int, refused: bool
) -> None:
    monkeypatch.setattr("drivers.optoncdt.sensor._COUNTING", 0.3)
    over = threading.Event()

    def send(peer: Peer) -> None:
        peer.wait_heard(len(OPENED) + 3)
        begin, done = now(), 30
        while not over.is_set():
            due = 30 + int((now() - begin) * sent)
            peer.send(b"".join(measurements(np.zeros(due - done, np.int32), done + 1)))
            done = due
            time.sleep(0.005)

    with Peer([*without_queries(streaming(30)), *STOPPED]) as peer, opened(peer) as laser:
        sender = threading.Thread(target=send, args=(peer,))
        sender.start()
        try:
            if refused:
                with pytest.raises(InvalidInput, match=r"sends (19|20)\d\d 1/s instead"):
                    laser.start()
            else:
                laser.start()
        finally:
            over.set()
            sender.join(LONG)
            assert not sender.is_alive()


def test_a_sensor_that_restarts_with_its_factory_settings_is_told_as_that() -> None:
    with Peer([*streaming(30), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        eventually(laser, 30 - LOCK)
        # distances alone, as from the factory: each word begins a measurement
        peer.send(b"".join(encode(30_000 + k, True) for k in range(300)))
        with pytest.raises(ConnectionLost, match="restarted with its factory settings"):
            until(lambda: bool(len(laser.take())))


def test_an_unplugged_sensor_is_told_by_take_every_time() -> None:
    with no_thread_left(), Peer(streaming(30)[:], tidy=False) as peer:
        laser = opened(peer)
        laser.start()
        eventually(laser, 30 - LOCK)
        peer.unplug()
        assert laser.wait(LONG)
        for _ in range(2):
            with pytest.raises(ConnectionLost, match=r"laser_1 on .* was disconnected .*; plug it in"):
                laser.take()
        laser.stop()
        laser.close()
        laser.close()


def test_values_from_before_a_failure_are_not_lost() -> None:
    with no_thread_left(), Peer(streaming(30)[:], tidy=False) as peer:
        laser = opened(peer)
        laser.start()
        stream = laser._stream
        assert stream is not None
        until(lambda: stream._holding == 30 - LOCK)
        peer.unplug()
        until(lambda: stream._failure is not None)
        assert len(laser.take()) == 30 - LOCK
        with pytest.raises(ConnectionLost):
            laser.take()
        laser.close()


def test_a_sensor_that_was_switched_off_in_between_is_a_lost_connection() -> None:
    with Peer([*streaming(3000), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        eventually(laser, 3000 - LOCK)
        peer.send(b"".join(measurements(CODES[:100], 0)))
        until(lambda: laser.wait(0.1))
        with pytest.raises(ConnectionLost, match="restarted its counter"):
            laser.take()


@pytest.mark.parametrize(("on", "cut"), [(True, 3), (False, 3), (False, 4)])
def test_the_beam_is_switched_while_values_come(on: bool, cut: int) -> None:
    """The answer may stand between values or within one."""
    command = b"LASERPOW FULL" if on else b"LASERPOW OFF"
    sent = measurements(CODES, 1)
    mixed = b"".join(sent[50:60]) + sent[60][:cut] + b"->" + sent[60][cut:] + b"".join(sent[61:300])
    with Peer([*streaming(50), (command, mixed), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        before = eventually(laser, 50 - LOCK)
        laser.laser(on)
        peer.send(b"".join(sent[300:]))
        after = eventually(laser, 4000 - 300 - 1)
        for got in (before, after):
            np.testing.assert_array_equal(got.code, CODES[got.index - 1])


def test_the_beam_is_switched_at_rest() -> None:
    with Peer([*OPENED, (b"LASERPOW OFF", b"->")]) as peer, opened(peer) as laser:
        laser.laser(False)


def test_a_command_that_is_not_answered_while_values_come_times_out() -> None:
    with Peer([*streaming(50), (b"LASERPOW OFF", b""), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        with pytest.raises(DeviceTimeout, match="did not reply to LASERPOW OFF"):
            laser.laser(False)


def test_a_stream_can_be_stopped_and_started_again_and_counts_anew() -> None:
    again = streaming(40)[len(OPENED) :]
    with no_thread_left(), Peer([*streaming(30), *STOPPED, *again, *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        with pytest.raises(RigError, match=r"start is refused: laser_1 on .* is streaming"):
            laser.start()
        laser.stop()
        laser.stop()
        assert len(laser.take()) == 30 - LOCK
        laser.start()
        assert eventually(laser, 40 - LOCK).index[0] == LOCK + 1


def test_what_is_not_possible_is_refused() -> None:
    with Peer(OPENED) as peer:
        laser = opened(peer)
        with pytest.raises(RigError, match="was not started; start it first"):
            laser.take()
        laser.close()
        for refused in (laser.start, lambda: laser.laser(True)):
            with pytest.raises(RigError, match=r"laser_1 on .* is closed; reopen it"):
                refused()
        laser.close()


def test_the_last_minute_is_kept_when_nobody_takes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.optoncdt.stream._KEPT", 0.5)
    with Peer([*streaming(30), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        peer.send(b"".join(measurements(CODES[30:], 31)))
        until(lambda: peer.unread == 0)
        until(lambda: laser.silent)
        got = laser.take()
        # what is read at once is dropped at once: a pseudo-terminal holds 4096 bytes, 341 measurements
        assert 2000 - 2 * 341 <= len(got) <= 2000
        assert got.index[-1] == 4000


def test_text_that_nobody_asked_for_never_makes_a_value() -> None:
    sent = measurements(CODES, 1)
    with Peer([*streaming(50), *STOPPED]) as peer, opened(peer) as laser:
        laser.start()
        peer.send(b"".join(sent[50:300]) + INFO + b"".join(sent[300:]))
        got = eventually(laser, 4000 - LOCK)
        np.testing.assert_array_equal(got.code, CODES[LOCK:])
