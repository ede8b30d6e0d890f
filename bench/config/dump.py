"""A configuration as the text of a file that reads back as the same."""

from typing import Any

import tomlkit

from bench.config.model import BenchConfiguration


def as_toml(configuration: BenchConfiguration) -> str:
    """Every key that has a value. What no other backend needs of the simulated one is left out."""
    unused = {"simulation"} if configuration.backend != "simulated" else set[str]()
    plain: dict[str, Any] = configuration.model_dump(mode="json", exclude_none=True, exclude=unused)
    return tomlkit.dumps(plain)
