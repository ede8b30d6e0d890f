"""`rockbench gui`: the operator's window."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bench.app.catalogue import all_protocols
from bench.app.cli.inputs import configuration_from
from bench.app.cli.interrupt import leave, leaving
from bench.app.cli.options import Handed, Seed, SpecimenFile
from bench.app.cli.output import print_warning
from bench.progress import silent
from sim.errors import InvalidInput, RockbenchError
from sim.extras import require

HEADLESS = "`rockbench run`, which needs no window"

PROBE = "from PySide6.QtGui import QGuiApplication; QGuiApplication([])"
"""Python code that starts Qt as a test. It is run in a separate process, because Qt aborts the process on failure."""

PATIENCE = 20.0
"""Timeout for the display [s]; a forwarded display may be slow."""

PACKAGES = {
    "libEGL.so": "libegl1",
    "libGL.so": "libgl1",
    "libxcb-cursor.so": "libxcb-cursor0",
    "libxkbcommon.so": "libxkbcommon0",
    "libxkbcommon-x11.so": "libxkbcommon-x11-0",
    "libwayland-client.so": "libwayland-client0",
    "libwayland-cursor.so": "libwayland-cursor0",
    "libwayland-egl.so": "libwayland-egl1",
    "libdbus-1.so": "libdbus-1-3",
    "libfontconfig.so": "libfontconfig1",
    "libxcb-icccm.so": "libxcb-icccm4",
    "libxcb-image.so": "libxcb-image0",
    "libxcb-keysyms.so": "libxcb-keysyms1",
    "libxcb-render-util.so": "libxcb-render-util0",
}
"""Debian and Ubuntu packages of the system libraries that Qt's wheels do not include."""


class NoDisplay(InvalidInput):
    """Error: no window can be opened on this system. `item` is the environment variable or library that prevents it,
    `allowed` the remedy.
    """

    def __init__(self, item: str, why: str, remedy: str) -> None:
        RockbenchError.__init__(self, f"rockbench gui cannot open a window: {why}; {remedy}, or use {HEADLESS}")
        self.item, self.value, self.allowed = item, why, remedy


def gui(
    *,
    config: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="Configuration of the bench (TOML).",
            show_default="the paper's specimen on the simulated bench, with a guided tour",
        ),
    ] = None,
    seed: Seed = None,
    specimen: SpecimenFile = None,
    queue: Annotated[
        Path, Parameter(metavar="FILE", help="File of the queue, which `rockbench queue` can also run.")
    ] = Path("runs", "queue.json"),
    progress: Handed = silent,
) -> int:
    """Open the operator's window.

    Each run is a separate process. When the window closes, the run ramps the output to zero and ends, unless it was set
    to continue without the window. STOP in the window is a request to the software; the emergency stop is the red
    button at the bench.
    """
    require("gui", "rockbench gui")
    progress("opening the window")
    configuration = configuration_from(config, seed, specimen)
    require_display()
    protocols, failed = all_protocols()
    for line in failed:
        print_warning(line)
    # the window selects the first protocol: the campaign of the paper
    protocols = sorted(protocols, key=lambda each: each.name != "harmonic")
    # until the window installs its own handler, Ctrl-C ends the process: Qt would abort it on an exception raised while
    # PySide6 is imported
    with leaving():
        from bench.app.gui.window import end_reading, open_window

        code = open_window(configuration, protocols, config, queue)
    if not end_reading():
        leave(code)
    return code


def require_display() -> None:
    """Check that Qt can open a window. Raises NoDisplay naming the environment variable or library that prevents it."""
    if sys.platform in ("win32", "darwin"):
        return
    chosen = next((name for name in ("QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "DISPLAY") if os.environ.get(name)), None)
    if chosen is None:
        why = "neither DISPLAY nor WAYLAND_DISPLAY is set"
        raise NoDisplay("DISPLAY", why, "start it on a desktop or over `ssh -X`")
    try:
        probe = subprocess.run(
            [sys.executable, "-P", "-c", PROBE],
            env=os.environ | {"QT_DEBUG_PLUGINS": "1"},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        why = f"{chosen} = {os.environ[chosen]!r} did not respond within {PATIENCE:g} s"
        raise NoDisplay(chosen, why, "start it on a desktop or over `ssh -X`") from None
    if probe.returncode == 0:
        return
    lacking = re.search(r"(lib[\w.+-]+?\.so)([.\d]*): cannot open shared object", probe.stderr)
    if lacking is not None:
        library, version = lacking.groups()
        package = PACKAGES.get(library)
        remedy = (
            "install the package that provides it" if package is None else f"install it (Debian: apt install {package})"
        )
        raise NoDisplay(library, f"the library {library}{version} is missing", remedy)
    why = f"Qt cannot use {chosen} = {os.environ[chosen]!r}"
    remedy = "set it to one of Qt's platforms or unset it" if chosen == "QT_QPA_PLATFORM" else "start it on a desktop"
    raise NoDisplay(chosen, why, remedy)
