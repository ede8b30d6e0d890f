"""Loading of the compiled model; the first use after an installation compiles it once, which takes many seconds."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module

MODEL = {"roots": 6, "watching": 8, "resting": 14, "steps": 3, "rocking": 20, "members": 40}
"""Modules of `sim.kernel` used by every prediction, with their shares of the compilation time."""

BENCH = {**MODEL, "laser": 3, "filter": 2, "plant": 8, "table": 15}
"""Modules used by a simulated bench."""


def load_model(
    report: Callable[[str, int, int], None] = lambda _phase, _done, _all: None, modules: Mapping[str, int] = MODEL
) -> None:
    """Import the `modules`. `report` is called with a description, the shares of the time that have passed and all."""
    if all(f"sim.kernel.{name}" in sys.modules for name in modules):
        return
    report("loading the model", 0, 0)
    is_compiled = import_module("sim.kernel.compiled").is_compiled
    phase = "loading the model"
    if not all(is_compiled(name) for name in modules):
        phase = "compiling the model, once per installation, about 12 s"
    done, total = 0, sum(modules.values())
    for name, share in modules.items():
        report(phase, done, total)
        import_module(f"sim.kernel.{name}")
        done += share
    report(phase, total, total)
