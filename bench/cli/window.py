"""`rockbench gui`: the operator's window."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.catalogue import CATALOGUE
from bench.cli.check import CHECK
from bench.cli.inputs import Seed, SpecimenFile, configuration_from
from sim.extras import require


def gui_app() -> App:
    """`rockbench gui`."""
    app = App(name="gui", help="Open the operator's window.", version_flags=())
    app.default(gui)
    return app


def gui(
    *,
    config: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="Configuration of the bench (TOML).",
            show_default="the paper's specimen on the simulated bench, with a first minute that is guided",
        ),
    ] = None,
    seed: Seed = None,
    specimen: SpecimenFile = None,
    queue: Annotated[
        Path, Parameter(metavar="FILE", help="File that keeps the queue; `rockbench queue` runs the same one.")
    ] = Path("runs", "queue.json"),
) -> int:
    """Open the operator's window.

    Runs go on in a process of their own: a window that is closed or dies lets them ramp out. Its STOP asks the
    program; the emergency stop is the red button at the bench.
    """
    require("gui", "rockbench gui")
    configuration = configuration_from(config, seed, specimen)

    from bench.gui.app import open_window

    return open_window(configuration, (*CATALOGUE, CHECK), config, queue)
