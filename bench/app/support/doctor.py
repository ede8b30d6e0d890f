"""Checks of the computer that runs a bench; every fault found is reported with a remedy."""

import importlib.util
import os
import platform
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from bench.app.support.awake import INHIBITION
from bench.provenance import software

OLDEST = (3, 11)
RESOLUTION = 1e-4
"""Largest acceptable step of the computer's clock [s]."""
LATE = 0.005
"""Largest acceptable delay of a sleep of 1 ms [s]; it must be short compared with a default block of samples."""
SPEED = 20e6
"""Minimum write speed of the disk [B/s], many times the data rate of a run."""
ROOM = 5e9
"""Smallest acceptable free space [B]."""
LATENCY = 1
"""Largest acceptable latency timer of a serial adapter [ms]; the usual default, 16 ms, delays the readings of a laser.
"""


class Health(StrEnum):
    """Result of a check of the computer."""

    GOOD = "good"
    NOTICE = "notice"
    BAD = "bad"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Finding:
    """A line of the report: the checked item, the result of the check, the observation and the remedy."""

    item: str
    health: Health
    found: str
    remedy: str = ""


def _not_checked(item: str, remedy: str) -> Finding:
    """Finding of a check that exists only for other operating systems."""
    return Finding(item, Health.UNKNOWN, "not checked on this platform", remedy)


def examine(folder: Path, port: str | None = None) -> Iterator[Finding]:
    """Check this computer for runs with results in `folder`; `port` is the address host:port of a device server.

    A check that cannot be carried out is reported as unknown.
    """
    checks: dict[str, Callable[[], Finding]] = {
        "versions": versions,
        "clock": clock,
        "timer": timer,
        "disk space": lambda: disk_space(folder),
        "disk speed": lambda: disk_speed(folder),
        "power settings": power,
        "sleep": sleep,
        "USB suspend": usb_suspend,
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
    """Check that Python is recent and has 64 bits; the finding also lists the versions of the libraries."""
    versions = ", ".join(f"{name} {version}" for name, version in software().items())
    good = sys.version_info[:2] >= OLDEST and sys.maxsize > 2**32
    remedy = "" if good else f"install a 64-bit Python, {OLDEST[0]}.{OLDEST[1]} or newer"
    return Finding("versions", Health.GOOD if good else Health.BAD, f"{versions}, {platform.system()}", remedy)


def clock() -> Finding:
    """Check the resolution of the clock that paces a run."""
    step = time.get_clock_info("perf_counter").resolution
    good = step <= RESOLUTION
    remedy = "" if good else "enable the high-precision timer in the firmware of the computer"
    return Finding("clock", Health.GOOD if good else Health.BAD, f"steps of {1e6 * step:.3g} us", remedy)


def timer() -> Finding:
    """Check the largest delay of twenty short sleeps."""
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
    """Check the free space for results."""
    free = shutil.disk_usage(folder).free
    remedy = "" if free >= ROOM else "free disk space, or set --out to another disk"
    return Finding(
        "disk space", Health.GOOD if free >= ROOM else Health.BAD, f"{free / 1e9:.3g} GB free in {folder}", remedy
    )


def disk_speed(folder: Path) -> Finding:
    """Check the write speed, including the flush to the disk."""
    size = 2**24
    with tempfile.TemporaryFile(dir=folder, prefix=".speed-") as file:
        begin = time.perf_counter()
        file.write(os.urandom(size))
        file.flush()
        os.fsync(file.fileno())
        speed = size / (time.perf_counter() - begin)
    remedy = "" if speed >= SPEED else "set --out to a local disk, not a network share"
    return Finding(
        "disk speed", Health.GOOD if speed >= SPEED else Health.BAD, f"{speed / 1e6:.3g} MB/s in {folder}", remedy
    )


def power(
    governor: Path = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"), system: str = sys.platform
) -> Finding:
    """Check whether the processor's frequency governor saves power; on Linux only."""
    item, remedy = "power settings", "switch off sleep and USB suspend during runs"
    if system != "linux":
        return _not_checked(item, remedy)
    if not governor.is_file():
        return Finding(item, Health.UNKNOWN, "not determined", remedy)
    mode = governor.read_text(encoding="utf-8").strip()
    if mode in ("powersave", "conservative"):
        return Finding(item, Health.NOTICE, f"governor {mode}", "select the performance governor")
    return Finding(item, Health.GOOD, f"governor {mode}")


def sleep(which: Callable[[str], str | None] = shutil.which, system: str = sys.platform) -> Finding:
    """Check whether a run can keep the computer from going to sleep; on Linux by trying it."""
    item = "sleep"
    if system == "win32":
        return Finding(item, Health.GOOD, "a run keeps the computer awake; closing the lid still suspends it")
    program = {"linux": "systemd-inhibit", "darwin": "caffeinate"}.get(system)
    path = None if program is None else which(program)
    # systemd-logind may refuse it, for example to a session over ssh
    if path is not None and (system != "linux" or _succeeds(path, *INHIBITION, "true")):
        return Finding(item, Health.GOOD, f"a run keeps the computer awake ({program})")
    remedy = "switch off sleep in the power settings of this computer"
    return Finding(item, Health.NOTICE, "a run cannot keep the computer awake", remedy)


def usb_suspend(devices: Path = Path("/sys/bus/usb/devices"), system: str = sys.platform) -> Finding:
    """Check whether NI's USB devices and serial adapters can be suspended when idle; on Linux and Windows only."""
    item = "USB suspend"
    if system == "win32":
        return _windows_usb_suspend(_answer("powercfg", "/query", "SCHEME_CURRENT", "SUB_USB", _SELECTIVE))
    if system != "linux":
        return _not_checked(item, "switch off the suspension of idle USB devices")
    suspended = [path.parent.parent for path in sorted(devices.glob("*/power/control")) if _read(path) == "auto"]
    ours = [device.name for device in suspended if _read(device / "idVendor") in _VENDORS]
    if not ours:
        return Finding(item, Health.GOOD, "no NI device or serial adapter can be suspended")
    remedy = f'write "on" to the file power/control of each device in {devices}, or add a udev rule that does so'
    return Finding(item, Health.BAD, f"can be suspended when idle: {', '.join(ours)}", remedy)


_SELECTIVE = "48e6b7a6-50f5-4782-a5d4-53bb8f07e226"
"""Identifier of the setting "USB selective suspend" (Microsoft's documentation of power settings)."""
_VENDORS = {"3923": "NI", "0403": "FTDI", "10c4": "Silicon Labs", "067b": "Prolific", "1a86": "WCH"}
"""Vendors of NI's USB devices and of serial adapters, by USB vendor identifier (hexadecimal)."""


def _windows_usb_suspend(output: str) -> Finding:
    """Evaluate the output of powercfg: its last two numbers are the settings on mains power and on battery power, 0
    for off.
    """
    item = "USB suspend"
    found = [word for word in output.split() if word.startswith("0x")]
    if len(found) < 2:
        return Finding(item, Health.UNKNOWN, "not determined", "switch off USB selective suspend in the power plan")
    if any(int(each, 16) for each in found[-2:]):
        remedy = "switch it off: Power Options, advanced settings, USB settings"
        return Finding(item, Health.BAD, "USB selective suspend is on", remedy)
    return Finding(item, Health.GOOD, "USB selective suspend is off")


def _succeeds(*command: str) -> bool:
    try:
        # without a terminal, so that no password is asked for
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=10.0, check=False, start_new_session=True
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _answer(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=10.0, check=False)
    except subprocess.TimeoutExpired:
        return ""
    return done.stdout


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def serial_ports(
    adapters: Path = Path("/sys/bus/usb-serial/devices"),
    devices: Path = Path("/dev"),
    system: str = sys.platform,
) -> Finding:
    """Check the latency timers of serial adapters, and the permission to open their ports; on Linux only."""
    item = "serial ports"
    if system != "linux":
        return _not_checked(item, f"set the latency timer of serial adapters to {LATENCY} ms in the driver's settings")
    found = sorted(adapters.glob("*")) if adapters.is_dir() else []
    if not found:
        return Finding(item, Health.GOOD, "no serial adapter")
    for adapter in found:
        if not os.access(devices / adapter.name, os.R_OK | os.W_OK):
            return Finding(item, Health.BAD, f"{adapter.name} cannot be opened", "add the user to the group dialout")
        timer = adapter / "latency_timer"
        if timer.is_file() and int(timer.read_text(encoding="utf-8")) > LATENCY:
            found = f"latency timer of {adapter.name}: {timer.read_text(encoding='utf-8').strip()} ms"
            return Finding(item, Health.BAD, found, f"write {LATENCY} to {timer}")
    return Finding(item, Health.GOOD, ", ".join(adapter.name for adapter in found))


def opengl(cards: Path = Path("/dev/dri"), system: str = sys.platform) -> Finding:
    """Check whether the window is installed and, on Linux, whether a graphics card is present."""
    if importlib.util.find_spec("PySide6") is None:
        return Finding(
            "OpenGL", Health.NOTICE, "the window is not installed", "to use the window, install rocking-bench[gui]"
        )
    if system != "linux":
        return _not_checked("OpenGL", "if the window stays blank, update the graphics driver")
    if not cards.is_dir():
        return Finding(
            "OpenGL", Health.NOTICE, "no graphics card", "render the window in software: set LIBGL_ALWAYS_SOFTWARE=1"
        )
    return Finding("OpenGL", Health.GOOD, "graphics card found")


def device_server(address: str) -> Finding:
    """Check whether a device server accepts a connection at `address` (host:port)."""
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=2.0):
            return Finding("device server", Health.GOOD, f"{address} responds")
    except (OSError, ValueError, OverflowError) as error:
        remedy = "start the device server on that computer, and open its port in the firewall"
        return Finding("device server", Health.BAD, f"{address} does not respond ({error})", remedy)
