"""Pictures of every page for the documentation, taken while the virtual bench runs one harmonic point.

`QT_QPA_PLATFORM=offscreen python -m tests.gui.screenshots docs/images`; existing pictures are replaced. Results of the
run go to a temporary folder that is not shown.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from math import isfinite
from pathlib import Path

from PySide6.QtWidgets import QApplication

from bench.cli.catalogue import CATALOGUE
from bench.config.model import BenchConfiguration
from bench.events import Estimate, Event
from bench.gui.app import dress
from bench.gui.controller import Controller
from bench.gui.palette import DARK, LIGHT
from bench.gui.window import Window
from bench.link.messages import Question

LONG = 180.0
SIZE = (1280, 800)


def main(folder: Path) -> None:
    """Take them all; raises AssertionError when the run does not come so far."""
    application = QApplication([])
    for theme, suffix in ((LIGHT, ""), (DARK, "-dark")):
        dress(application, theme)
        controller = Controller()
        window = Window(controller, BenchConfiguration(), CATALOGUE, theme, tour=True)
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
                    window.run.traces.draw()
                    window.header.refresh()
                    window.grab().save(str(folder / f"window-run{suffix}.png"))

        controller.told.connect(measuring)
        asked: list[Question] = []
        controller.asked.connect(lambda question, asked=asked: asked.append(question) if question else None)
        window.pages.setCurrentWidget(window.setup)
        application.processEvents()
        picture("setup")
        window.pages.setCurrentWidget(window.protocol)
        window.protocol.realtime.setChecked(False)
        window.protocol.person.setChecked(True)
        window.protocol.survey()
        until(lambda: window.protocol.start.isEnabled())  # noqa: B023
        picture("protocol")
        with tempfile.TemporaryDirectory() as out:
            window.protocol.folder.setText(str(Path(out) / "run"))
            window.protocol.begin()
            until(lambda: asked)  # noqa: B023
            picture("prompt")
            controller.answer(agreed=True)
            until(lambda: len(asked) > 1)  # noqa: B023
            controller.answer(agreed=True)
            until(lambda: not controller.running)  # noqa: B023
            application.processEvents()
            picture("results")
        window.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
