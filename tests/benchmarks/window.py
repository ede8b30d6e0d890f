"""Speed of the window: `QT_QPA_PLATFORM=offscreen python -m tests.benchmarks.window [SECONDS [BLOCK]]`.

Six channels of 20 000 samples/s in blocks of 25 ms (or BLOCK seconds) are reduced as the session's process does it and
shown as the window does it, both paced by the clock. Printed: what the reduction costs, frames per second, the
processor's time of the window, and the time from a block's reading to the end of its drawing.
"""

import sys
import time

import numpy as np
from PySide6.QtWidgets import QApplication

from bench.analysis.signals import SignalMap
from bench.cli.catalogue import CATALOGUE
from bench.config.model import BenchConfiguration, Simulation
from bench.events import Acquired
from bench.gui.app import dress
from bench.gui.controller import Controller
from bench.gui.palette import LIGHT
from bench.gui.window import Window
from bench.link.reduction import Reduction
from drivers.clock import now
from drivers.rig import Block
from drivers.simulated import SimulatedRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE = 20_000.0


def main(seconds: float, length: float) -> None:
    """Measure and print."""
    parameters = VirtualBenchParameters(sample_rate=RATE)
    channels = SimulatedRig(parameters, Specimen(), seed=1).channels
    six = (*channels, *channels)[:6]
    reduction = Reduction(six, RATE, SignalMap(six, "ground"))
    n = round(length * RATE)
    phase = 2.0 * np.pi * 5.0 * np.arange(n) / RATE
    counts = np.round(3000.0 * np.sin(phase))[:, None].repeat(6, axis=1).astype(np.int16)
    begun = time.monotonic()
    application = QApplication([])
    dress(application, LIGHT)
    controller = Controller()
    window = Window(controller, BenchConfiguration(simulation=Simulation(bench=parameters)), CATALOGUE, LIGHT)
    window.pages.setCurrentWidget(window.run)
    window.show()
    application.processEvents()
    print(f"window usable after {time.monotonic() - begun:.2f} s (imports not counted)")
    frames, delays, spent = 0, list[float](), 0.0
    unseen: list[float] = []
    draw = window.run.traces.draw

    def counted() -> None:
        nonlocal frames
        draw()
        window.repaint()
        frames += bool(unseen)
        delays.extend(now() - read for read in unseen)
        unseen.clear()

    window.run.traces.draw = counted  # type: ignore[method-assign]
    start, block, used = now(), 0, time.process_time()
    while now() - start < seconds:
        if now() - start >= (block + 1) * length:
            before = time.process_time()
            event = Acquired((block + 1) * length, 1, Block(block * n, counts), np.sin(phase))
            traces = reduction(event)
            spent += time.process_time() - before
            controller.traced.emit([traces])
            unseen.append(traces.read)
            block += 1
        application.processEvents()
        time.sleep(0.001)
    passed = now() - start
    used = time.process_time() - used - spent
    print(f"reduction: {100.0 * spent / passed:.1f} % of a core")
    print(f"window: {frames / passed:.1f} frames/s that show something new, {100.0 * used / passed:.0f} % of a core")
    shown = ", ".join(f"{p} %: {1e3 * float(np.percentile(delays, p)):.0f} ms" for p in (50, 95, 100))
    print(f"from reading a block to its drawing, {shown} (the oldest sample of a block is {1e3 * length:.0f} ms older)")
    controller.close()


if __name__ == "__main__":
    asked = [float(each) for each in sys.argv[1:]]
    main(asked[0] if asked else 10.0, asked[1] if len(asked) > 1 else 0.025)
