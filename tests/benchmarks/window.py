"""Speed of the window: `python -m tests.benchmarks.window [SECONDS [BLOCK]]`; without a screen unless told otherwise.

Six channels of 20 000 samples/s in blocks of 100 ms (or BLOCK seconds) are reduced and sent by a process of its own at
the pace of the clock, as the process of a session does, and shown by the whole window on its Run page. Printed, each
beside its target:

- start-up: wall clock and processor from the start of Python to a window that has been drawn, beside a bare window of
  PySide6 and pyqtgraph with one plot as the peer, the better of three each;
- drawings per second of the traces' view, as Qt painted them, and blocks per second that were new;
- delay: from the reading of a block to the end of its drawing, and the same from the block's first sample;
- the processor's time of the window's process, link included, as a share of one core;
- memory: an hour of blocks in as many seconds as they take, resident set size fitted over the second half.
"""

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Literal

import numpy as np
from PySide6.QtCore import QEvent, QEventLoop, QObject
from PySide6.QtWidgets import QApplication

from bench.analysis.signals import SignalMap
from bench.app.catalogue import all_protocols
from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.palette import dress
from bench.app.gui.window import Window
from bench.app.ipc.broadcast import Reduction
from bench.app.ipc.messages import Traces
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.events import Acquired
from drivers.clock import now
from drivers.rig import Block
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE, CHANNELS = 20_000.0, 6
PARAMETERS = VirtualBenchParameters(sample_rate=RATE)
HOUR, TOGETHER = 3600.0, 30
"""Seconds of the soak, and how many of its blocks are drawn at once."""

OURS = """
from bench.app.catalogue import all_protocols
from bench.app.cli.inputs import configuration_from
configuration = configuration_from(None, None)
from PySide6.QtWidgets import QApplication
from bench.app.gui.palette import dress
from bench.app.gui.controller import Controller
from bench.app.display.theme import LIGHT
from bench.app.gui.window import Window
application = QApplication([])
controller = Controller()
window = Window(controller, configuration, all_protocols()[0], LIGHT, tour=True)
dress(application, LIGHT)
"""
PEER = """
import pyqtgraph
from PySide6.QtWidgets import QApplication, QMainWindow
application = QApplication([])
window = QMainWindow()
window.resize(1280, 800)
plot = pyqtgraph.PlotWidget()
plot.plot([0.0, 1.0], [0.0, 1.0])
window.setCentralWidget(plot)
"""
SHOWN = """
window.show()
window.grab()
application.processEvents()
import os, time
print(time.process_time(), flush=True)
os._exit(0)
"""


class Paints(QObject):
    """Counts how often Qt paints the traces, and measures how old what it paints is when it has been painted."""

    def __init__(self, window: Window) -> None:
        super().__init__()
        self.painted = 0
        self.delays: list[float] = []
        self._traces = window.run.traces
        self._new, self._drawn = list[Traces](), list[Traces]()
        self._seen = False
        self._draw = self._traces.draw
        self._traces.draw = self._taken  # type: ignore[method-assign]
        self._traces.view.viewport().installEventFilter(self)

    def add(self, traces: list[Traces]) -> None:
        """Given to the window just now."""
        self._new += traces

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: ARG002 - the signature is Qt's
        if event.type() == QEvent.Type.Paint:
            self.painted += 1
            self._seen = True
        return False

    def look(self) -> None:
        """Call after events were processed: what was painted among them is on the screen now."""
        if self._seen:
            self.delays += [now() - traces.read for traces in self._drawn]
            self._drawn.clear()
            self._seen = False

    def _taken(self) -> None:
        self._draw()
        self._drawn += self._new
        self._new.clear()


class Fed:
    """Stands in for `bench.app.ipc.client.SessionClient`: a process that reduces, a thread that receives."""

    status: Literal["linked"] = "linked"
    silence, lives = 0.0, True

    def __init__(self, length: float, seconds: float) -> None:
        self._received = deque[Traces]()
        self.taken: Callable[[list[Traces]], None] = lambda _: None
        self.share: float | None = None
        self._ours, theirs = multiprocessing.Pipe(duplex=False)
        self.feeder = multiprocessing.get_context("spawn").Process(target=feed, args=(theirs, length, seconds))
        self.feeder.start()
        threading.Thread(target=self._hear, daemon=True).start()

    def take(self) -> list[Traces]:
        taken = [self._received.popleft() for _ in range(len(self._received))]
        self.taken(taken)
        return taken

    def alive(self) -> None:
        """The real one says so to the session."""

    def leave(self) -> None:
        """Nobody is left behind."""

    def _hear(self) -> None:
        while not isinstance(message := self._ours.recv(), float):
            self._received.append(message)
        self.share = message


def start_up(code: str) -> tuple[float, float]:
    """Wall clock and processor [s] from the start of Python to the drawn window, the best of three."""
    found: list[tuple[float, float]] = []
    for _ in range(3):
        begun = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", code + SHOWN], capture_output=True, text=True, check=True)
        found.append((time.perf_counter() - begun, float(done.stdout.split()[-1])))
    return min(found)


def made(n: int) -> tuple[Reduction, np.ndarray, np.ndarray, np.ndarray]:
    """The reduction of a session, and a block of `n` samples of six channels with its drive and signals."""
    channels = SimulatedRig(PARAMETERS, Specimen(), seed=1).channels
    six = (*channels, *channels)[:CHANNELS]
    phase = 2.0 * np.pi * 5.0 * np.arange(n) / RATE
    noise = np.random.default_rng(1).normal(0.0, 30.0, (n, CHANNELS))
    counts = np.round(3000.0 * np.sin(phase)[:, None] + noise).astype(np.int16)
    values = np.column_stack([channel.to_unit(counts[:, k]) for k, channel in enumerate(six)])
    return Reduction(RATE), counts, np.sin(phase), SignalMap(six, "ground").of(values)


def feed(connection: Connection, length: float, seconds: float) -> None:
    """The session's side: blocks of `length` seconds at the pace of the clock; at the end, its processor's time."""
    n = round(length * RATE)
    reduction, counts, drive, signals = made(n)
    start, used = now(), time.process_time()
    for block in range(int(seconds / length)):
        time.sleep(max(start + (block + 1) * length - now(), 0.0))
        connection.send(reduction(Acquired(1, Block(block * n, counts), drive, signals, time=(block + 1) * length)))
    connection.send((time.process_time() - used) / seconds)


def resident() -> float:
    """Resident set size [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def live(window: Window, application: QApplication, controller: Controller, length: float, seconds: float) -> None:
    """Show what the other process sends, as the window does it by itself, and print how it went."""
    link, paints = Fed(length, seconds), Paints(window)
    start, used, blocks = 0.0, 0.0, 0

    def taken(traces: list[Traces]) -> None:
        nonlocal start, used, blocks
        if traces and not start:
            start, used, paints.painted = now(), time.process_time(), 0
        blocks += len(traces)
        paints.add(traces)

    link.taken = taken
    controller._link, controller._running = link, True  # type: ignore[assignment]
    while link.share is None:
        application.processEvents(QEventLoop.ProcessEventsFlag.WaitForMoreEvents)
        paints.look()
    passed, used = now() - start, time.process_time() - used
    link.feeder.join()
    controller._link, controller._running = None, False
    shown = ", ".join(f"{p} %: {1e3 * float(np.percentile(paints.delays, p)):.0f} ms" for p in (50, 95, 99))
    worst = 1e3 * (float(np.percentile(paints.delays, 95)) + length)
    print(f"blocks of {1e3 * length:.0f} ms, {passed:.0f} s:")
    print(f"  drawings {paints.painted / passed:.1f} /s (target 30); new blocks {blocks / passed:.1f} /s")
    print(f"  delay from a block's reading to its drawing {shown}")
    print(f"  delay from the block's first sample to its drawing, 95 %: {worst:.0f} ms (target 150)")
    print(f"  window {100.0 * used / passed:.0f} % of a core (target 40), reduction {100.0 * link.share:.1f} %")


def hour(application: QApplication, controller: Controller, length: float) -> None:
    """An hour of blocks as fast as they are taken, drawn thirty at a time; resident memory over its second half."""
    n = round(length * RATE)
    reduction, counts, drive, signals = made(n)
    low_high = reduction(Acquired(1, Block(0, counts), drive, signals, time=length))
    begun, sizes, total = now(), list[tuple[float, float]](), int(HOUR / length)
    low, high, step = low_high.low, low_high.high, low_high.step
    for first in range(0, total, TOGETHER):
        blocks = [Traces(1, block * length, step, low, high, now()) for block in range(first, first + TOGETHER)]
        controller.traced.emit(blocks)
        application.processEvents()
        if first % (total // 60) < TOGETHER:
            sizes.append((first / total, resident()))
    half = np.array(sizes[len(sizes) // 2 :])
    slope = float(np.polyfit(half[:, 0], half[:, 1], 1)[0])
    print(
        f"an hour of blocks in {now() - begun:.0f} s: {sizes[0][1]:.0f} MB at first, {sizes[-1][1]:.0f} MB at the end"
    )
    print(f"  over the second half {slope:+.2f} MB/h, {np.ptp(half[:, 1]):.2f} MB from least to largest (target: flat)")


def main(seconds: float, length: float) -> None:
    """Measure and print."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    os.environ["ROCKBENCH_SESSIONS"] = "off"
    for name, code in (("window", OURS), ("peer: bare PySide6 and pyqtgraph", PEER)):
        wall, processor = start_up(code)
        print(
            f"start-up, {name}: {wall:.2f} s wall, {processor:.2f} s processor"
            + (" (target 2 s)" if code is OURS else "")
        )
    application = QApplication([])
    dress(application, LIGHT)
    controller = Controller()
    window = Window(controller, BenchConfiguration(simulation=Simulation(bench=PARAMETERS)), all_protocols()[0], LIGHT)
    window.pages.setCurrentWidget(window.run)
    window.show()
    application.processEvents()
    live(window, application, controller, length, seconds)
    hour(application, controller, length)
    controller.close()


if __name__ == "__main__":
    asked = [float(each) for each in sys.argv[1:]]
    main(asked[0] if asked else 20.0, asked[1] if len(asked) > 1 else 0.1)
