"""Shake-table bench software: `predict`, `run` and `open` for scripts and notebooks; see docs/python.md."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bench.app.measurements import Campaign, Quantity
    from bench.app.measurements import Campaign as open
    from bench.app.predictions import predict
    from bench.app.run import run
    from bench.config.model import BenchConfiguration as Configuration
    from bench.config.toml import read_configuration
    from sim.errors import InvalidInput
    from sim.specimen import Specimen

__all__ = [
    "Campaign",
    "Configuration",
    "InvalidInput",
    "Quantity",
    "Specimen",
    "open",
    "predict",
    "read_configuration",
    "run",
]

_PLACES = {
    "Campaign": "bench.app.measurements:Campaign",
    "Configuration": "bench.config.model:BenchConfiguration",
    "InvalidInput": "sim.errors:InvalidInput",
    "Quantity": "bench.app.measurements:Quantity",
    "Specimen": "sim.specimen:Specimen",
    "open": "bench.app.measurements:Campaign",
    "predict": "bench.app.predictions:predict",
    "read_configuration": "bench.config.toml:read_configuration",
    "run": "bench.app.run:run",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _PLACES[name].partition(":")
    found = globals()[name] = getattr(import_module(module), attribute)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
