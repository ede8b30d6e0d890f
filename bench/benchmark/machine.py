"""The machine and the software that a benchmark ran on: without them its numbers mean nothing."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version

from bench.provenance import software

PEERS = ("heyoka", "scikit-sundae", "mpmath")
"""Libraries that only the benchmark uses."""


def machine() -> dict[str, str]:
    """Processor, number of cores and operating system."""
    return {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": platform.platform(),
    }


def versions() -> dict[str, str]:
    """Versions of the software, with those of the peers that are installed."""
    return software() | {name: _version(name) for name in ("llvmlite", *PEERS)}


def _processor() -> str:
    try:
        # Linux has the full name only here
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
