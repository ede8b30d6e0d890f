"""Ownership of the bench's devices: opening a device resets it, which would end the run of another program.

Each device and serial port has a lock file on this machine. The operating system holds the lock and releases it when
the process ends, however it ends; the holder's name is in a second file, because a locked file cannot be read on
Windows.
"""

import getpass
import hashlib
import os
import sys
import time
from collections.abc import Generator, Iterable
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import gettempdir

from filelock import FileLock, Timeout

from drivers.daqmx.parameters import device_name
from drivers.errors import DeviceNotFound
from drivers.hardware.parameters import Hardware

FOLDER = "ROCKBENCH_LOCKS"
"""Environment variable that names the folder of the locks; the default folder is shared by all users of this
machine.
"""


def devices_of(hardware: Hardware) -> list[str]:
    """The devices that a rig opens: the chassis or card of the drive, and the serial ports."""
    daq = hardware.daq
    where = f" at {daq.server}" if daq.server else ""
    ports = [given.port for _, given in hardware.serial_lasers if given.port is not None]
    return [f"{device_name(daq.output)}{where}", *(os.path.realpath(port) if "/" in port else port for port in ports)]


@contextmanager
def owned(devices: Iterable[str]) -> Generator[None]:
    """Context manager that owns the `devices`. Raises DeviceNotFound naming the program that holds one of them."""
    with ExitStack() as held:
        for device in devices:
            held.enter_context(_owned(device))
        yield


@contextmanager
def _owned(device: str) -> Generator[None]:
    folder = _folder()
    stem = hashlib.sha256(device.casefold().encode()).hexdigest()[:16]
    lock = FileLock(folder / f"{stem}.lock", blocking=False, mode=0o666, thread_local=False, fallback_to_soft=False)
    name = folder / f"{stem}.owner"
    try:
        lock.acquire()
    except Timeout:
        raise DeviceNotFound(f"{device} is in use by {_holder(name)}: end that run, or close that program") from None
    except OSError as error:
        remedy = f"check the folder, or name another in the environment variable {FOLDER}"
        raise DeviceNotFound(f"{device} cannot be locked in {folder} ({error.strerror or error}): {remedy}") from error
    try:
        # on a full disk the name is missing, but the lock holds
        with suppress(OSError):
            name.unlink(missing_ok=True)
            name.write_text(_own_name(), encoding="utf-8")
        yield
    finally:
        with suppress(OSError):
            name.unlink(missing_ok=True)
        lock.release()


def _folder() -> Path:
    given = os.environ.get(FOLDER)
    shared = os.environ.get("PROGRAMDATA") if sys.platform == "win32" else None
    folder = Path(given or Path(shared or gettempdir(), "rockbench-devices"))
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        # other users must be able to lock the same files; in a sticky folder Linux would not allow it
        folder.chmod(0o777)
    return folder


def _own_name() -> str:
    command = " ".join([Path(sys.argv[0]).name, *sys.argv[1:3]])
    try:
        user = getpass.getuser()
    except (OSError, KeyError, ImportError):
        user = "unknown user"
    return f"{command} (process {os.getpid()}, {user}, since {time.strftime('%H:%M')})"


def _holder(name: Path) -> str:
    for _ in range(10):
        with suppress(OSError):
            if text := name.read_text(encoding="utf-8", errors="replace")[:200]:
                return text
        # the holder writes its name just after locking
        time.sleep(0.02)
    return "another program"
