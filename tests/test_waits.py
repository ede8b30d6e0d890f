"""No wait of a main thread is longer than 0.2 s at a time: on Windows before Python 3.14, Ctrl-C does not end it.

Every wait in the sources is listed here with the reason why a signal need not end it, or goes through `sim.waiting`.
"""

import ast
import queue
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sim import waiting
from tests.patience import LONG as PATIENCE

ROOT = Path(__file__).parents[1]
LONG = {
    *("join", "wait", "wait_for", "get", "put", "acquire", "result", "recv", "accept", "readline"),
    *("communicate", "shutdown", "sleep", "as_completed"),
}
"""Names of methods that may wait."""
CALL = re.compile(rf"\.\s*(?:{'|'.join(sorted(LONG | {'run'}))})\s*\(")
"""A call of one of them; files without any need not be parsed."""

THREAD = "in a thread of its own, which no signal concerns"
SHORT = "shorter than a step"
NOT_LONG = "does not wait"
CHILD = "for a child process of the same console, which the same Ctrl-C ends"
OWN = "in a process of its own, which its parent ends"
ASKS = "for a person's answer: the console ends it at Ctrl-C"

LISTED = {
    "bench/app/benchmark/commands.py time.sleep": SHORT,
    "bench/app/benchmark/scaling.py subprocess.run": CHILD,
    "bench/app/cli/console.py self._changed.wait": THREAD,
    "bench/app/cli/console.py self._closing.wait": THREAD,
    "bench/app/cli/interrupt.py self._unanswered.acquire": NOT_LONG,
    "bench/app/cli/interrupt.py threading.Event().wait": THREAD,
    "bench/app/cli/interrupt.py self._numbers.recv": THREAD,
    "bench/app/cli/interrupt.py saying.join": THREAD,
    "bench/app/cli/terminal.py self._answers.readline": ASKS,
    "bench/app/cli/watch.py child.output.readline": "the process of the page answers after its start, or ends",
    "bench/app/cli/window.py subprocess.run": CHILD,
    "bench/app/ipc/announcement.py listener.accept": THREAD,
    "bench/app/ipc/broadcast.py self._changed.wait": THREAD,
    "bench/app/ipc/client.py self.process.wait": THREAD,
    "bench/app/ipc/client.py self._talking.join": THREAD,
    "bench/app/ipc/client.py sender.join": THREAD,
    "bench/app/ipc/client.py self._listener.accept": THREAD,
    "bench/app/ipc/client.py self._outgoing.get": THREAD,
    "bench/app/ipc/process.py connection.recv": NOT_LONG,
    "bench/app/ipc/process.py sys.stdin.readline": "the client has written the line before the process starts",
    "bench/app/ipc/server.py self.broadcast.join": NOT_LONG,
    "bench/app/ipc/server.py self._host.answers.get": SHORT,
    "bench/app/ipc/server.py self._notes.get": NOT_LONG,
    "bench/app/reading_process.py process.wait": SHORT,
    "bench/app/reading_process.py self._lock.acquire": SHORT,
    "bench/app/support/doctor.py time.sleep": SHORT,
    "bench/app/support/doctor.py subprocess.run": CHILD,
    "bench/app/cli/closing.py threading.Event().wait": THREAD,
    "bench/app/watch/feed.py self._changed.wait_for": THREAD,
    "bench/app/watch/process.py sys.stdin.readline": "the parent has written the line before it waits for the answer",
    "bench/app/watch/server.py self._free.acquire": NOT_LONG,
    "bench/app/watch/server.py self.shutdown": "at most the poll interval of the server, 0.1 s",
    "bench/datafile/rows.py self._pool.shutdown": NOT_LONG,
    "bench/datafile/opening.py time.sleep": SHORT,
    "bench/datafile/recorder.py self._queue.get": THREAD,
    "bench/datafile/recorder.py self._wanted.wait": THREAD,
    "bench/datafile/held.py time.sleep": THREAD,
    "bench/engine/stalls.py self._over.wait": THREAD,
    "bench/figures/text_table.py captured.get": NOT_LONG,
    "bench/provenance.py subprocess.run": CHILD,
    "bench/testing/resources.py time.sleep": SHORT,
    "bench/twin/live.py stream.join": NOT_LONG,
    "bench/twin/twin.py estimator.result": THREAD,
    "bench/twin/twin.py members.result": THREAD,
    "bench/twin/twin.py self._worker.shutdown": NOT_LONG,
    "bench/unfinished.py time.sleep": SHORT,
    "drivers/daqmx/connection.py ready.result": NOT_LONG,
    "drivers/daqmx/clock_watch.py sys.stdin.buffer.readline": OWN,
    "drivers/daqmx/clock_watch.py time.sleep": OWN,
    "drivers/emulation/bench.py self._over.wait": THREAD,
    "drivers/emulation/control.py lines.readline": THREAD,
    "drivers/emulation/control.py connection.shutdown": NOT_LONG,
    "drivers/emulation/control.py self._listening.accept": THREAD,
    "drivers/emulation/control.py connection.recv": SHORT,
    "drivers/emulation/daqmx/server.py self._changed.wait": THREAD,
    "drivers/emulation/daqmx/server.py self._pool.shutdown": "only after a failed start, without any work",
    "drivers/emulation/daqmx/timing.py changed.wait": THREAD,
    "drivers/emulation/daqmx/watchdog.py self._changed.wait": THREAD,
    "drivers/emulation/optoncdt/laser.py time.sleep": THREAD,
    "drivers/emulation/optoncdt/socket_line.py self._client.recv": NOT_LONG,
    "drivers/emulation/optoncdt/socket_line.py self._listener.accept": NOT_LONG,
    "drivers/hardware/tracks.py sensor.wait": "waits in steps, in `drivers.optoncdt.stream`",
    "drivers/optoncdt/sensor.py self._stream.wait": "waits in steps, in `drivers.optoncdt.stream`",
    "drivers/optoncdt/sensor.py stream.wait": "waits in steps, in `drivers.optoncdt.stream`",
    "drivers/optoncdt/line.py commands.readline": OWN,
    "drivers/optoncdt/line.py pending.get": OWN,
    "drivers/optoncdt/line.py time.sleep": OWN,
    "drivers/optoncdt/line.py writer.join": OWN,
    "drivers/optoncdt/port.py cast(Any, self)._socket.recv": NOT_LONG,
    "sim/process_lock.py self._lock.acquire": NOT_LONG,
    "sim/process_lock.py time.sleep": SHORT,
    "sim/sweep.py future.result": "the futures are finished",
    "sim/sweep.py pool.shutdown": NOT_LONG,
}


def _waits() -> Iterator[str]:
    """Every call in the sources that may wait, as `file receiver.method`."""
    for room in ("bench", "drivers", "sim", "protocols"):
        for path in sorted((ROOT / room).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            if path == ROOT / "sim" / "waiting.py" or not CALL.search(text):
                continue
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and _may_wait(node, node.func):
                    yield f"{path.relative_to(ROOT).as_posix()} {ast.unparse(node.func)}"


def _may_wait(call: ast.Call, method: ast.Attribute) -> bool:
    name = method.attr
    if name not in LONG | {"run"}:
        return False
    receiver = ast.unparse(method.value)
    if name == "run":
        return receiver == "subprocess"
    if receiver in ("waiting", "event") or receiver.startswith("texts."):
        # Qt's events are accepted, and texts joined, not waited for
        return False
    numbers = all(isinstance(each, ast.Constant | ast.Name | ast.BinOp) for each in call.args)
    match name:
        case "join":
            # texts and paths are joined too
            return not isinstance(method.value, ast.Constant | ast.JoinedStr | ast.IfExp) and numbers
        case "get":
            return not call.args
        case "put":
            return any(each.arg in ("block", "timeout") for each in call.keywords)
        case "acquire" | "result":
            return not call.args or (name == "result" and numbers and "future" in receiver)
        case _:
            return True


def test_every_wait_is_listed_or_in_steps() -> None:
    assert {*_waits()} - {*LISTED} == set()


@contextmanager
def longest_wait(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """The time-outs with which this thread waits for locks and threads; infinite where it gives none."""
    asked, main = [0.0], threading.current_thread()
    wait, join = threading.Condition.wait, threading.Thread.join

    def waits(self: threading.Condition, timeout: float | None = None) -> bool:
        # the start of a thread waits for the thread's first instruction
        starting = sys._getframe(2).f_code is threading.Thread.start.__code__
        if threading.current_thread() is main and not starting:
            asked.append(float("inf") if timeout is None else timeout)
        return wait(self, timeout)

    def joins(self: threading.Thread, timeout: float | None = None) -> None:
        if threading.current_thread() is main:
            asked.append(float("inf") if timeout is None else timeout)
        join(self, timeout)

    with monkeypatch.context() as patched:
        patched.setattr(threading.Condition, "wait", waits)
        patched.setattr(threading.Thread, "join", joins)
        yield asked


def _frozen_thread(frozen: threading.Event) -> bool:
    thread = threading.Thread(target=frozen.wait)
    thread.start()
    return waiting.join(thread)


def _frozen_condition(frozen: threading.Event) -> bool:
    changed = threading.Condition()
    with changed:
        return waiting.wait_for(changed, frozen.is_set, 5.0)


def _frozen_work(frozen: threading.Event) -> bool:
    pool = ThreadPoolExecutor(1)
    work = pool.submit(frozen.wait)
    pool.shutdown(wait=False)
    return waiting.result(work)


def _full_queue(frozen: threading.Event) -> bool:
    full = queue.Queue[int](1)
    full.put(1)
    threading.Thread(target=lambda: (frozen.wait(), full.get())).start()
    return waiting.put(full, 2, 5.0)


def _frozen_console(frozen: threading.Event) -> bool:
    """The terminal takes no text, so that the painter hangs."""
    from io import StringIO

    from rich.console import Console

    from bench.app.cli.console import LiveConsole

    display = LiveConsole(Console(file=StringIO(), force_terminal=True))
    with display:
        draw = partial(frozen.wait, PATIENCE)
        display._draw = lambda: draw() and None  # type: ignore[method-assign]
        display.prepare("a phase")
        time.sleep(0.01)
    return True


def _frozen_port(frozen: threading.Event) -> bool:
    """The serial port does not return from a read."""
    from drivers.optoncdt.stream import Stream

    class Line:
        def chunks(self) -> Iterator[tuple[bytes, float]]:
            frozen.wait(PATIENCE)
            yield from ()

        def close(self) -> None: ...

        def release(self) -> None: ...

    stream = Stream.__new__(Stream)
    stream._over, stream._line = True, Line()  # type: ignore[assignment]
    stream._thread = threading.Thread(target=stream._run)
    stream._thread.start()
    stream.end()
    return True


def _frozen_process(frozen: threading.Event) -> bool:
    """A child process that hangs is killed."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], stdin=subprocess.PIPE)
    with process:
        waiting.end(process, 0.3)
    return waiting.wait(frozen, 1.0)


def _frozen_disk(frozen: threading.Event, end: Callable[[Any], object], tmp_path: Path) -> bool:
    from tests.bench.datafile.living import begin, hand_over

    recorder = begin(tmp_path / "run.h5")
    take = recorder._take

    def hangs(item: Any) -> None:
        frozen.wait(PATIENCE)
        take(item)

    recorder._take = hangs  # type: ignore[method-assign]
    hand_over(recorder, 0)
    end(recorder)
    recorder.close("completed")
    return True


def _frozen_request(frozen: threading.Event) -> bool:
    """A handler of the emulated laboratory does not return: neither does the client's request, nor closing."""
    from drivers.emulation.control import ControlServer, ask

    server = ControlServer({"hang": lambda _: frozen.wait(PATIENCE)})
    done = ask(server.address, "hang", patience=PATIENCE)
    server.close()
    return bool(done)


FREEZES: dict[str, Callable[[threading.Event], bool]] = {
    "thread": _frozen_thread,
    "event": lambda frozen: waiting.wait(frozen),
    "condition": _frozen_condition,
    "work": _frozen_work,
    "queue": _full_queue,
    "console": _frozen_console,
    "serial port": _frozen_port,
    "child process": _frozen_process,
    "laboratory": _frozen_request,
}


@pytest.mark.parametrize("what", FREEZES)
def test_a_wait_for_something_frozen_is_in_steps(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    _judge(FREEZES[what], monkeypatch)


@pytest.mark.parametrize("end", ["sync", "close"])
def test_a_wait_for_a_frozen_disk_is_in_steps(end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ends: dict[str, Callable[[Any], object]] = {
        "sync": lambda recorder: recorder.sync(),
        "close": lambda recorder: recorder.close("completed"),
    }
    _judge(partial(_frozen_disk, end=ends[end], tmp_path=tmp_path), monkeypatch)


def _judge(freeze: Callable[[threading.Event], bool], monkeypatch: pytest.MonkeyPatch) -> None:
    frozen = threading.Event()
    thaw = threading.Timer(0.3, frozen.set)
    thaw.start()
    with longest_wait(monkeypatch) as asked:
        assert freeze(frozen)
    assert max(asked) <= waiting.STEP


@pytest.mark.seconds
def test_a_wait_ends_in_time_and_reports_it() -> None:
    begun = time.monotonic()
    assert not waiting.wait(threading.Event(), 0.05)
    assert not waiting.put(_full(), 2, 0.0)
    assert time.monotonic() - begun < 1.0


def test_the_error_of_the_work_is_raised() -> None:
    def fails() -> None:
        raise TimeoutError("the work's own")

    with ThreadPoolExecutor(1) as pool, pytest.raises(TimeoutError, match="own"):
        waiting.result(pool.submit(fails))


def _full() -> "queue.Queue[int]":
    full = queue.Queue[int](1)
    full.put(1)
    return full
