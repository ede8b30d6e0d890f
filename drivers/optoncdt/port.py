"""Opening a serial port, and saying why it cannot be opened."""

import errno
import sys
from contextlib import suppress

from serial import Serial, SerialException
from serial.tools import list_ports

from drivers.errors import DeviceNotFound

if sys.platform == "win32":
    _PORT_ERRORS = (OSError, ValueError)
else:
    import termios

    # the library lets this one through where the system refuses a setting
    _PORT_ERRORS = (OSError, ValueError, termios.error)

FACTORY_BAUD = 921_600
BAUDS = (FACTORY_BAUD, 1_000_000, 691_200, 460_800, 256_000, 230_400, 128_000, 115_200, 56_000, 19_200, 9_600)
"""Baud rates that the sensor can be set to, the factory's first (manual, p. 84 and p. 116)."""

_READ_TIMEOUT = 0.02
_WRITE_TIMEOUT = 1.0
_WINDOWS_BUFFER = 1 << 18


def listed_ports() -> list[str]:
    """The serial ports that the system lists."""
    return sorted(port.device for port in list_ports.comports())


def open_port(name: str, port: str, baud: int) -> Serial:
    """Open `port` for `name` alone, 8 data bits, no parity, one stop bit (manual, p. 84).

    Raises DeviceNotFound when the port is absent, held by somebody else, not permitted or not a serial port.
    """
    try:
        opened = Serial(port, baud, timeout=_READ_TIMEOUT, write_timeout=_WRITE_TIMEOUT, exclusive=True)
    except _PORT_ERRORS as error:
        raise DeviceNotFound(f"{name} cannot be opened: {_reason(port, error)}") from error
    _hurry(opened)
    return opened


def has_baud(port: Serial, baud: int) -> bool:
    """Set the baud rate of an open port; False when its adapter or the system does not have this one."""
    try:
        port.baudrate = baud
    except _PORT_ERRORS:
        return False
    return True


def _hurry(port: Serial) -> None:
    """Have values handed on at once where the adapter can, and room for them where the system gives little."""
    if sys.platform == "win32":
        port.set_buffer_size(rx_size=_WINDOWS_BUFFER)
    elif sys.platform == "linux":
        with suppress(ValueError):
            port.set_low_latency_mode(True)


def _reason(port: str, error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    # on Windows the library gives the system's error as text only; there a port in use is one that is not permitted
    windows = isinstance(error, SerialException) and number is None
    if number in (errno.EBUSY, errno.EAGAIN) or (windows and "PermissionError" in str(error)):
        return f"{port} is in use; close the program that holds it"
    if number in (errno.EACCES, errno.EPERM):
        return f"{port} may not be used by this account; add it to the group that owns the port (dialout, uucp)"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or (windows and "FileNotFoundError" in str(error)):
        there = ", ".join(listed_ports()) or "none"
        return f"there is no port {port}; plug in the adapter or correct the name (ports there are: {there})"
    return f"{port} does not work as a serial port ({error}); check the name and the adapter's driver"
