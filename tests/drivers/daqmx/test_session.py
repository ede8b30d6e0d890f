"""A run through the real nidaqmx client: what is played is what is read, and every way to stop is safe."""

import threading

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.daqmx.session import DaqSession
from drivers.errors import RigError
from sim.errors import InvalidInput
from tests.drivers.daqmx.conftest import LEAD, RATE, OpenSession
from tests.drivers.daqmx.loopback import COUNTS_PER_VOLT, Loopback
from tests.drivers.daqmx.runs import BLOCK, driving, is_safe, started
from tests.patience import LONG, eventually


def test_the_session_says_what_the_device_is(session: DaqSession) -> None:
    assert session.sample_rate == RATE
    assert session.drive_range == 10.0
    assert session.dtype is np.int16
    # 16 bits over +-10 V, rails excluded
    assert [scaling.coefficients for scaling in session.scalings] == [(0.0, 20.0 / 65536.0)] * 4
    assert {(scaling.lowest, scaling.highest, scaling.bits) for scaling in session.scalings} == {(-32767, 32766, 16)}
    description = session.description
    assert description["device Dev1"] == "USB-6363, serial number 01C0FFEE"
    assert description["driver"] == "NI-DAQmx 23.8.0"
    assert description["start trigger"] == "/Dev1/ai/StartTrigger"
    assert description["tasks left by another client"] == "none"
    assert all(description.values())


def test_sample_i_of_the_drive_is_sample_i_of_the_inputs(session: DaqSession) -> None:
    volts = np.random.default_rng(7).uniform(-9.0, 9.0, 3100)
    ahead = 2000
    started(session, volts[:ahead])
    blocks: list[NDArray[np.int16 | np.int32]] = []
    for n in (1, 7, 200, 92, 300, 500):
        done = sum(len(block) for block in blocks)
        session.write(volts[ahead + done : ahead + done + n])
        blocks.append(session.read(n))
    assert all(block.flags.c_contiguous and block.flags.owndata and block.dtype == np.int16 for block in blocks)
    counts = np.concatenate(blocks)
    expected = np.round(COUNTS_PER_VOLT * volts[:1100])[:, np.newaxis] + [0, 10, 20, 30]
    np.testing.assert_array_equal(counts, expected)
    assert session.acquired() >= 1100


def test_a_block_that_was_read_stays_as_it_was(session: DaqSession) -> None:
    started(session, np.linspace(1.0, 2.0, 300))
    first = session.read(BLOCK)
    kept = first.copy()
    session.read(BLOCK)
    np.testing.assert_array_equal(first, kept)


def test_nothing_moves_before_the_start(session: DaqSession, plant: Loopback) -> None:
    session.prepare()
    assert plant.enabled
    session.write(np.full(LEAD, 3.0))
    begin = plant.tick()
    eventually(lambda: plant.tick() > begin + 100)
    assert not plant.played().any()


def test_a_session_can_be_run_again_and_begins_with_what_is_written_then(session: DaqSession) -> None:
    driving(session).stop()
    started(session, np.full(LEAD, -1.0))
    assert (session.read(50)[:, 0] == -round(COUNTS_PER_VOLT)).all()


def test_more_than_the_buffer_holds_is_waited_for(session: DaqSession) -> None:
    # the buffer holds the lead and 2 s, the device's own memory 8191 samples (its data sheet)
    started(session, np.zeros(LEAD + round(2.0 * RATE)))
    for n in (4000, 4191, 600):
        session.write(np.zeros(n))
    assert session.acquired() >= 600


def test_more_than_the_buffer_holds_is_refused_before_the_start(session: DaqSession, plant: Loopback) -> None:
    session.prepare()
    with pytest.raises(RigError, match="start the output first"):
        session.write(np.zeros(LEAD + round(2.0 * RATE) + 1))
    eventually(lambda: is_safe(plant))


@pytest.mark.parametrize("end", ["stop", "close"])
def test_an_end_opens_the_relay_and_zeroes_the_output(session: DaqSession, plant: Loopback, end: str) -> None:
    driving(session)
    assert plant.enabled
    assert plant.present_output() == 3.0
    for _ in range(3):
        getattr(session, end)()
    eventually(lambda: is_safe(plant))


def test_an_exception_of_the_caller_is_an_end_too(open_session: OpenSession, plant: Loopback) -> None:
    def run() -> None:
        with open_session() as session:
            driving(session)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run()
    eventually(lambda: is_safe(plant))
    assert plant.ever_enabled


def test_the_relay_is_cut_while_another_thread_reads(session: DaqSession, plant: Loopback) -> None:
    started(session, np.full(round(RATE), 3.0))
    read: list[int] = []
    reader = threading.Thread(target=lambda: read.append(len(session.read(round(0.8 * RATE)))))
    reader.start()
    assert session.cut() is True
    assert not plant.enabled
    assert not read
    reader.join(LONG)
    assert read == [round(0.8 * RATE)]


def test_a_stop_ends_a_read_of_another_thread(session: DaqSession, plant: Loopback) -> None:
    started(session, np.full(round(RATE), 3.0))
    ended = threading.Event()

    def read() -> None:
        with pytest.raises(RigError):
            session.read(round(60.0 * RATE))
        ended.set()

    reader = threading.Thread(target=read)
    reader.start()
    eventually(lambda: session.acquired() > 100)
    session.stop()
    assert ended.wait(LONG)
    reader.join()
    eventually(lambda: is_safe(plant))
    # and the read has not started the clock again
    assert len(started(session).read(10)) == 10


def test_a_cut_is_undone_by_the_next_run_only(session: DaqSession, plant: Loopback) -> None:
    driving(session)
    session.cut()
    session.write(np.zeros(10))
    assert not plant.enabled
    session.stop()
    session.prepare()
    assert plant.enabled


def test_a_cut_since_the_arming_began_prevents_the_run(session: DaqSession, plant: Loopback) -> None:
    cuts = session.cuts
    session.cut()
    plant.ever_enabled = False
    with pytest.raises(RigError, match="enable line was cut"):
        session.prepare(cuts)
    assert not plant.ever_enabled
    session.stop()
    driving(session)
    assert plant.enabled


def test_without_enable_line_there_is_nothing_to_cut(open_session: OpenSession, plant: Loopback) -> None:
    session = driving(open_session(enable_line=None))
    assert session.cut() is False
    session.stop()
    assert plant.present_output() == 0.0
    assert not plant.ever_enabled


def test_a_cut_after_the_close_reports_that_nobody_confirmed_it(session: DaqSession) -> None:
    session.close()
    assert session.cut() is False


@pytest.mark.parametrize("state", ["fresh", "stopped", "closed"])
@pytest.mark.parametrize("call", ["write", "start", "read", "acquired"])
def test_a_session_that_is_not_prepared_does_nothing(session: DaqSession, call: str, state: str) -> None:
    if state != "fresh":
        driving(session)
        session.stop() if state == "stopped" else session.close()
    arguments = {"write": (np.zeros(10),), "read": (10,)}.get(call, ())
    with pytest.raises(RigError, match="is refused"):
        getattr(session, call)(*arguments)


def test_a_session_is_prepared_once_and_read_when_it_runs(session: DaqSession) -> None:
    session.prepare()
    for refused in (session.prepare, lambda: session.read(1)):
        with pytest.raises(RigError, match="prepared, not started"):
            refused()
    session.write(np.zeros(LEAD))
    session.start()
    with pytest.raises(RigError, match="is running"):
        session.start()
    with pytest.raises(InvalidInput):
        session.read(0)
    assert len(session.read(1)) == 1


@pytest.mark.parametrize(("part", "step"), [("relay", "energise"), ("watchdog", "start"), ("output", "prepare")])
def test_a_stop_by_a_signal_during_the_arming_leaves_nothing_enabled(
    open_session: OpenSession, plant: Loopback, monkeypatch: pytest.MonkeyPatch, part: str, step: str
) -> None:
    """The handler runs in the same thread, between two steps; the interrupted call then goes on."""
    session = open_session(watchdog=5.0)
    interrupted = getattr(session._tasks, part)
    real = getattr(interrupted, step)

    def interrupting(*arguments: object) -> None:
        session.cut()
        session.stop()
        real(*arguments)

    monkeypatch.setattr(interrupted, step, interrupting)
    with pytest.raises(RigError):
        session.prepare()
    assert is_safe(plant)
    monkeypatch.undo()
    # and the device's watchdog does not hold the relay
    session.prepare()
    assert plant.enabled


def test_a_stop_by_a_signal_during_the_start_stops_the_clock(
    session: DaqSession, plant: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.prepare()
    session.write(np.full(LEAD, 3.0))
    inputs = session._tasks.inputs
    real = inputs.start

    def interrupting() -> None:
        session.cut()
        session.stop()
        real()

    monkeypatch.setattr(inputs, "start", interrupting)
    with pytest.raises(RigError, match="start is refused"):
        session.start()
    monkeypatch.undo()
    eventually(lambda: is_safe(plant))
    with pytest.raises(RigError, match="read is refused"):
        session.read(10)
    assert len(started(session).read(10)) == 10
