"""`rockbench gui`: the operator's window."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.catalogue import CATALOGUE
from bench.cli.check import CHECK
from bench.cli.inputs import configuration_from


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
    seed: Annotated[
        str | None, Parameter(metavar="INT", help="Seed of the simulation, in place of the configuration's.")
    ] = None,
) -> int:
    """Open the operator's window.

    Runs go on in a process of their own: a window that is closed or dies lets them ramp out. Its STOP asks the
    program; the emergency stop is the red button at the bench.
    """
    configuration = configuration_from(config, seed)

    from bench.gui.app import open_window

    return open_window(configuration, (*CATALOGUE, CHECK), config)
