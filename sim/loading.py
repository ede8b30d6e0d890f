"""Loads the compiled model, or compiles it: at the first use after an installation, once, for many seconds."""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module

MODEL = {"equations": 6, "roots": 6, "taylor": 10, "resting": 14, "rocking": 22, "period": 20}
"""Modules of `sim.kernel` that every prediction takes, with the share of each in the time of compilation."""

BENCH = {**MODEL, "laser": 3, "plant": 8, "table": 15}
"""Those that a simulated bench takes."""


def load_model(
    report: Callable[[str, int, int], None] = lambda _phase, _done, _all: None, modules: Mapping[str, int] = MODEL
) -> None:
    """Import the `modules`. `report` is called with what is done, in words, the parts done and those of all."""
    if all(f"sim.kernel.{name}" in sys.modules for name in modules):
        return
    report("loading the model", 0, 0)
    is_compiled = import_module("sim.kernel.compiled").is_compiled
    phase = "loading the model"
    if not all(is_compiled(name) for name in modules):
        phase = "compiling the model, once per installation, about 9 s"
    done, total = 0, sum(modules.values())
    for name, share in modules.items():
        report(phase, done, total)
        import_module(f"sim.kernel.{name}")
        done += share
    report(phase, total, total)
