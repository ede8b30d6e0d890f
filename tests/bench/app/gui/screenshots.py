"""Pictures of every page for the documentation, taken while the virtual bench runs one harmonic point.

`QT_QPA_PLATFORM=offscreen python -m tests.bench.app.gui.screenshots docs/images`; existing pictures are replaced.
Results of the run go to a temporary folder that is not shown.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import chdir
from math import isfinite
from pathlib import Path

from PySide6.QtWidgets import QApplication

from bench.app.catalogue import all_protocols, load_protocol
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.palette import dress
from bench.app.gui.window import Window
from bench.app.ipc.messages import Question
from bench.app.queue.queue import Stage, queued
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.events import Event
from bench.live_values import Estimate
from bench.results import FILE
from protocols.harmonic.protocol import HarmonicParameters
from tests.bench.app.gui.run_files import settle, show
from tests.patience import LONG

SIZE = (1280, 800)


def main(folder: Path) -> None:
    """Take them all; raises AssertionError when the run does not come so far."""
    folder = folder.resolve()
    # a run of somebody else must not be in the pictures
    os.environ["ROCKBENCH_SESSIONS"] = "off"
    # whatever is not told where to go goes there too
    with tempfile.TemporaryDirectory() as out, chdir(out):
        take(folder)


def take(folder: Path) -> None:
    """Pictures go to `folder`, results of the runs to a folder beside the present one."""
    application = QApplication([])
    ended: list[Path] = []
    for seed, (theme, suffix) in enumerate(((DARK, "-dark"), (LIGHT, ""))):
        dress(application, theme)
        controller = Controller()
        simulation = Simulation(seed=seed)
        window = Window(
            controller,
            BenchConfiguration(simulation=simulation),
            sorted(all_protocols()[0], key=lambda each: each.name != "harmonic"),
            theme,
            queue=Path("runs", "queue.json"),
            tour=True,
        )
        window.resize(*SIZE)
        window.show()

        def until(condition: Callable[[], object], application: QApplication = application) -> None:
            end = time.monotonic() + LONG
            while not condition():
                assert time.monotonic() < end
                application.processEvents()
                time.sleep(0.005)

        def picture(
            name: str, window: Window = window, suffix: str = suffix, application: QApplication = application
        ) -> None:
            # what was just said is laid out first
            for _ in range(3):
                application.processEvents()
            if not suffix:
                window.grab().save(str(folder / f"window-{name}{suffix}.png"))

        seen: list[Estimate] = []

        def measuring(event: Event, seen: list[Estimate] = seen, window: Window = window, suffix: str = suffix) -> None:
            """A virtual run is over in seconds: its picture is taken in the moment itself."""
            if isinstance(event, Estimate) and event.beta is not None and isfinite(event.alpha_2):
                seen.append(event)
                if len(seen) == 20:
                    window.run._draw()
                    window.header.refresh()
                    window.grab().save(str(folder / f"window-run{suffix}.png"))

        controller.event_received.connect(measuring)
        asked: list[Question] = []
        controller.question_changed.connect(lambda question, asked=asked: asked.append(question) if question else None)
        window.pages.setCurrentWidget(window.protocol)
        window.protocol.realtime.setChecked(False)
        window.protocol.person.setChecked(True)
        ended.append(Path("runs") / ("monday" if suffix else "tuesday"))
        window.protocol.folder.setText(str(ended[-1]))
        window.protocol.check_plan()
        until(lambda: window.protocol.start.isEnabled())  # noqa: B023
        picture("protocol")
        window.protocol.begin()
        until(lambda: asked)  # noqa: B023
        picture("prompt")
        controller.answer(agreed=True)
        until(lambda: len(asked) > 1)  # noqa: B023
        controller.answer(agreed=True)
        until(lambda: not controller.running)  # noqa: B023
        application.processEvents()
        window.pages.setCurrentWidget(window.results)
        settle(window.results)
        picture("results")
        if len(ended) > 1:
            results = window.results
            show(results, ended[0] / FILE)
            results.parts.setCurrentWidget(results.differences)
            picture("compare")
            results.parts.setCurrentWidget(results.histories)
            results.histories.run.setCurrentIndex(results.histories.run.count() - 1)
            results.histories.channel.setCurrentText("laser 2")
            until(lambda: [each.track.channel for each in results.histories.shown] == ["laser_2"])  # noqa: B023
            picture("samples")
            fill(window)
            picture("queue")
            window.pages.setCurrentWidget(window.setup)
            window.setup.loop.start()
            until(lambda: window.setup.loop.lines and not controller.running)  # noqa: B023
            picture("setup")
        window.close()


def fill(window: Window) -> None:
    """A queue with something of everything; nothing of it is run."""
    window.welcome.hide()
    window.pages.setCurrentWidget(window.queue)
    for omega, stage, told in (
        (14.0, Stage.DONE, "completed: the plan was carried out"),
        (15.0, Stage.FAILED, "aborted: drift 0.0812 m exceeds 0.08 m"),
        (16.0, Stage.WAITING, ""),
        (17.0, Stage.WAITING, ""),
        (18.0, Stage.SKIPPED, ""),
    ):
        asked = HarmonicParameters(omega=(omega,), beta=(0.4,), starts=3)
        test = queued(load_protocol("harmonic"), asked, Path("runs", f"omega-{omega:g}"), realtime=True)
        window.runner.queue.add(test.model_copy(update={"stage": stage, "outcome": told}))
    window.runner.changed.emit()
    window.queue.table.setCurrentCell(2, 0)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
