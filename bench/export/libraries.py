"""Libraries that only an export needs."""

from importlib import import_module
from typing import Any

from sim.errors import InvalidInput


def needed(module: str, kind: str) -> Any:
    """An optional library. Raises InvalidInput, naming what to install, where it is missing."""
    try:
        return import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise InvalidInput("--to", kind, f'it needs {library}: pip install "rocking-bench[export]"') from None
