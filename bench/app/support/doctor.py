"""Checks of the machine on which a bench is to run, each with what to do."""

import importlib.util
import os
import platform
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from bench.provenance import software

OLDEST = (3, 11)
RESOLUTION = 1e-4
"""Coarsest step of the machine's clock [s]."""
LATE = 0.005
"""Largest delay of a sleep of 1 ms that a block of samples bears [s]."""
SPEED = 20e6
"""Least speed of the disk [B/s]: many times that of a run."""
ROOM = 5e9
"""Free space for a day of runs [B]."""
LATENCY = 1
"""Latency timer of a serial adapter [ms]; the default of 16 delays the values of a laser."""


class Health(StrEnum):
    """Result of a check."""

    GOOD = "good"
    NOTICE = "notice"
    BAD = "bad"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Finding:
    """One line of the report: the checked item, its health, what was found, and what to do."""

    item: str
    health: Health
    found: str
    remedy: str = ""


def examine(folder: Path, port: str | None = None) -> Iterator[Finding]:
    """Check the machine, with results in `folder`; `port` is the address host:port of a device server.

    A check that fails itself is reported as unknown.
    """
    checks: dict[str, Callable[[], Finding]] = {
        "versions": versions,
        "clock": clock,
        "timer": timer,
        "disk space": lambda: disk_space(folder),
        "disk speed": lambda: disk_speed(folder),
        "power settings": power,
        "serial ports": serial_ports,
        "OpenGL": opengl,
        **({} if port is None else {"device server": lambda: device_server(port)}),
    }
    for item, check in checks.items():
        try:
            yield check()
        except OSError as error:
            yield Finding(item, Health.UNKNOWN, f"not determined: {error.strerror or error}")


def versions() -> Finding:
    """Python and the libraries."""
    told = ", ".join(f"{name} {version}" for name, version in software().items())
    good = sys.version_info[:2] >= OLDEST and sys.maxsize > 2**32
    remedy = "" if good else f"install a Python of 64 bits, {OLDEST[0]}.{OLDEST[1]} or newer"
    return Finding("versions", Health.GOOD if good else Health.BAD, f"{told}, {platform.system()}", remedy)


def clock() -> Finding:
    """Resolution of the clock that paces a run."""
    step = time.get_clock_info("perf_counter").resolution
    good = step <= RESOLUTION
    remedy = "" if good else "enable the high-precision timer in the firmware of the computer"
    return Finding("clock", Health.GOOD if good else Health.BAD, f"steps of {1e6 * step:.3g} us", remedy)


def timer() -> Finding:
    """Delay of short sleeps, the largest of twenty."""
    delays: list[float] = []
    for _ in range(20):
        begin = time.perf_counter()
        time.sleep(1e-3)
        delays.append(time.perf_counter() - begin - 1e-3)
    good = max(delays) <= LATE
    remedy = "" if good else "close other programs; choose the power plan for high performance"
    return Finding(
        "timer", Health.GOOD if good else Health.NOTICE, f"sleeps up to {1e3 * max(delays):.2g} ms late", remedy
    )


def disk_space(folder: Path) -> Finding:
    """Free space for results."""
    free = shutil.disk_usage(folder).free
    remedy = "" if free >= ROOM else "free disk space, or give --out on another disk"
    return Finding(
        "disk space", Health.GOOD if free >= ROOM else Health.BAD, f"{free / 1e9:.3g} GB free in {folder}", remedy
    )


def disk_speed(folder: Path) -> Finding:
    """Speed of writing, with the data on the disk."""
    size = 2**24
    with tempfile.TemporaryFile(dir=folder, prefix=".speed-") as file:
        begin = time.perf_counter()
        file.write(os.urandom(size))
        file.flush()
        os.fsync(file.fileno())
        speed = size / (time.perf_counter() - begin)
    remedy = "" if speed >= SPEED else "give --out on a local disk, not on a network share"
    return Finding(
        "disk speed", Health.GOOD if speed >= SPEED else Health.BAD, f"{speed / 1e6:.3g} MB/s in {folder}", remedy
    )


def power(governor: Path = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")) -> Finding:
    """Whether the processor is slowed down to save power."""
    item = "power settings"
    if not governor.is_file():
        return Finding(item, Health.UNKNOWN, "not determined", "switch sleep and USB suspend off for the time of a run")
    mode = governor.read_text(encoding="utf-8").strip()
    if mode in ("powersave", "conservative"):
        return Finding(item, Health.NOTICE, f"governor {mode}", "choose the governor performance")
    return Finding(item, Health.GOOD, f"governor {mode}")


def serial_ports(adapters: Path = Path("/sys/bus/usb-serial/devices"), devices: Path = Path("/dev")) -> Finding:
    """Latency timers of serial adapters, and permission to open their ports."""
    item, found = "serial ports", sorted(adapters.glob("*")) if adapters.is_dir() else []
    if not found:
        return Finding(item, Health.GOOD, "no serial adapter")
    for adapter in found:
        if not os.access(devices / adapter.name, os.R_OK | os.W_OK):
            return Finding(item, Health.BAD, f"{adapter.name} cannot be opened", "add the user to the group dialout")
        timer = adapter / "latency_timer"
        if timer.is_file() and int(timer.read_text(encoding="utf-8")) > LATENCY:
            told = f"latency timer of {adapter.name}: {timer.read_text(encoding='utf-8').strip()} ms"
            return Finding(item, Health.BAD, told, f"write {LATENCY} to {timer}")
    return Finding(item, Health.GOOD, ", ".join(adapter.name for adapter in found))


def opengl(cards: Path = Path("/dev/dri")) -> Finding:
    """Whether the window can draw."""
    if importlib.util.find_spec("PySide6") is None:
        return Finding("OpenGL", Health.NOTICE, "the window is not installed", "install the extra gui for the window")
    if sys.platform == "linux" and not cards.is_dir():
        return Finding(
            "OpenGL", Health.NOTICE, "no graphics card", "the window draws in software: LIBGL_ALWAYS_SOFTWARE=1"
        )
    return Finding("OpenGL", Health.GOOD, "graphics card found")


def device_server(address: str) -> Finding:
    """Whether the port of a device server answers through the firewall."""
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=2.0):
            return Finding("device server", Health.GOOD, f"{address} answers")
    except (OSError, ValueError, OverflowError) as error:
        remedy = "start the device server there, and open its port in the firewall"
        return Finding("device server", Health.BAD, f"{address} does not answer ({error})", remedy)
