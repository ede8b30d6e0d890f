"""Locks on devices. Opening a device resets it, which would end the run of another program that uses it.

Each device and serial port has a lock on this machine (`sim.process_lock`).
"""

import getpass
import hashlib
import os
import re
import sys
import time
from collections.abc import Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import gettempdir

from drivers.daqmx.parameters import device_name
from drivers.errors import DeviceNotFound
from drivers.hardware.parameters import Hardware
from sim.process_lock import LockHeld, ProcessLock

FOLDER = "ROCKBENCH_LOCKS"
"""Environment variable that sets the folder of the locks; all users of this machine share the default folder."""


def devices_of(hardware: Hardware) -> list[str]:
    """The devices that a rig locks: the DAQ devices of the drive and of the digital lines, each module after its
    chassis, and the serial ports. A chassis is locked too, because resetting it resets all its modules.
    """
    daq = hardware.daq
    where = f" at {_same_address(daq.server)}" if daq.server else ""
    once = dict[str, str]()
    for terminal in (daq.output, *daq.digital_lines.values()):
        for name in _chassis_and_device(terminal):
            # a device must be locked only once, and its name is case-insensitive
            once.setdefault(name.casefold(), f"{name}{where}")
    ports = [given.port for _, given in hardware.serial_lasers if given.port is not None]
    return [*once.values(), *(os.path.realpath(port) if port.startswith("/") else port for port in ports)]


def _chassis_and_device(terminal: str) -> list[str]:
    """Device of a terminal, preceded by its chassis if its name is a module's default name, such as `cDAQ1Mod2`."""
    device = device_name(terminal)
    module = re.fullmatch(r"(.+)Mod\d+", device, re.IGNORECASE)
    return [device] if module is None else [module[1], device]


def _same_address(server: str) -> str:
    """Address of a server, with 127.0.0.1 in place of other loopback names."""
    host, colon, port = server.rpartition(":")
    return f"127.0.0.1{colon}{port}" if host.casefold() in ("localhost", "::1", "[::1]") else server


@contextmanager
def owned(devices: Iterable[str]) -> Generator[None]:
    """Context manager that locks the `devices`. Raises DeviceNotFound if another program has locked one of them, which
    the message names, or if the lock cannot be created.
    """
    with ExitStack() as held:
        for device in devices:
            held.enter_context(_owned(device))
        yield


@contextmanager
def _owned(device: str) -> Generator[None]:
    folder = _folder()
    try:
        lock = ProcessLock(
            folder / hashlib.sha256(device.casefold().encode()).hexdigest()[:16], _own_name(), shared=True
        )
    except LockHeld as error:
        raise DeviceNotFound(f"{device} is in use by {error.holder}: end that run, or close that program") from None
    except OSError as error:
        remedy = f"check the folder, or set another one in the environment variable {FOLDER}"
        raise DeviceNotFound(f"{device} cannot be locked in {folder} ({error.strerror or error}): {remedy}") from error
    try:
        yield
    finally:
        lock.release()


def _folder() -> Path:
    given = os.environ.get(FOLDER)
    shared = os.environ.get("PROGRAMDATA") if sys.platform == "win32" else None
    folder = Path(given or Path(shared or gettempdir(), "rockbench-devices"))
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        # other users must be able to lock the same files, which Linux prevents in a sticky folder
        folder.chmod(0o777)
    return folder


def _own_name() -> str:
    # "-c" or "-m" instead of a program's path
    started = ["python", *sys.argv] if sys.argv[0].startswith("-") else [Path(sys.argv[0]).name, *sys.argv[1:]]
    command = " ".join(started[:3])
    try:
        user = getpass.getuser()
    except (OSError, KeyError, ImportError):
        user = "unknown user"
    return f"{command} (process {os.getpid()}, {user}, since {time.strftime('%H:%M')})"
