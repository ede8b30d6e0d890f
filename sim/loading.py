"""Loading of the compiled model; the first use after an installation compiles it once, which takes several seconds.

Compilation runs in two processes where there are two processors: a helper process compiles the modules in `APART`,
which use no other modules or only the first ones, into the same cache. Modules that it does not complete are compiled
in this process. Predictions of steady motions need no module of `APART`.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from threading import Event, Thread
from typing import IO

from sim.waiting import end, join, wait

STEADY = {"steps": 3, "roots": 5, "watching": 7, "members": 26}
"""Modules of `sim.kernel` used by predictions of steady motions, with their shares of the compilation time."""

MODEL = {**STEADY, "resting": 12, "rocking": 20}
"""Modules used by every prediction."""

RECORDS = {**MODEL, "members_at_rest": 14}
"""Modules used by predictions of many runs under a record."""

BENCH = {**STEADY, "laser": 2, "filter": 4, "instruments": 4, "resting": 12, "plant": 4, "table": 12, "rocking": 20}
"""Modules used by a simulated bench; those of the instruments come first, since this process compiles them while the
helper compiles the others.
"""

APART = ("resting", "plant", "table", "rocking")
"""Modules compiled by the helper, in this order."""

# the helper ends when it has compiled: a search for unreachable objects would take a tenth of its time
_HELPER = """
import gc, sys
gc.disable()
sys.path.insert(0, sys.argv[1])
from importlib import import_module
for name in sys.argv[2:]:
    import_module("sim.kernel." + name)
    print(name, flush=True)
"""


def load_model(
    report: Callable[[str, int, int], None] = lambda _phase, _done, _all: None, modules: Mapping[str, int] = MODEL
) -> None:
    """Import the `modules`. `report` is called with a description, the sum of the completed shares, and the total."""
    if all(f"sim.kernel.{name}" in sys.modules for name in modules):
        return
    report("loading the model", 0, 0)
    compiled = import_module("sim.kernel.compiled")
    missing = {name for name in modules if not compiled.is_compiled(name)}
    apart = [name for name in APART if name in missing] if compiled.cache_folder() is not None else []
    phase, done, total = "loading the model", 0, sum(modules.values())
    if missing:
        phase = "compiling the model, once per installation, about 8 s"
    with helped(apart) as ready:
        for name, share in modules.items():
            report(phase, done, total)
            if name in ready:
                wait(ready[name])
            import_module(f"sim.kernel.{name}")
            done += share
    report(phase, total, total)


@contextmanager
def helped(names: Sequence[str]) -> Generator[Mapping[str, Event], None, None]:
    """Context manager that runs the helper for the modules `names`, and provides an event for each module, which is set
    when the module has been compiled or the helper has ended.

    There are no events where a helper would not save time or cannot be started.
    """
    if not names or not sys.executable or (os.cpu_count() or 1) < 2:
        yield {}
        return
    command = [sys.executable, "-P", "-c", _HELPER, str(Path(__file__).parents[1]), *names]
    try:
        helper = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, close_fds=True
        )
    except OSError:
        yield {}
        return
    ready = {name: Event() for name in names}
    reader = Thread(target=_listen, args=(helper.stdout, ready), name="kernel helper", daemon=True)
    reader.start()
    try:
        yield ready
    finally:
        # a helper that is still running is killed
        end(helper, 0.0)
        join(reader)


def _listen(lines: IO[bytes], ready: Mapping[str, Event]) -> None:
    """Set the event of every module that the helper reports, and all of them when it ends."""
    with lines:
        for line in lines:
            if (name := line.decode().strip()) in ready:
                ready[name].set()
    for each in ready.values():
        each.set()
