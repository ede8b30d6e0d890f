"""One hash of everything that decides what a run does."""

import json
from dataclasses import asdict
from hashlib import sha256
from typing import Any, cast

from bench.config.model import BenchConfiguration
from bench.preflight.forecast import Forecast
from sim.parameters import Parameters

DIGITS = 9
"""Significant digits of a number that was computed: fewer than a processor's last bits can change."""


def plan_hash(
    protocol: str, parameters: Parameters, configuration: BenchConfiguration, version: str, forecast: Forecast
) -> str:
    """SHA-256, as 64 hexadecimal digits, over canonical JSON: sorted keys, no spaces, no NaN.

    What was asked for counts exactly, what was computed from it to nine digits.
    """
    content = {
        "protocol": protocol,
        "parameters": parameters.model_dump(mode="json"),
        "configuration": configuration.model_dump(mode="json"),
        "software": version,
        "forecast": _rounded(asdict(forecast)),
    }
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return sha256(text.encode("utf-8")).hexdigest()


def _rounded(value: Any) -> Any:
    """The same content with every float as text of so many digits."""
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}"
    if isinstance(value, dict):
        return {str(key): _rounded(item) for key, item in cast(dict[Any, Any], value).items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in cast(list[Any], value)]
    return value
