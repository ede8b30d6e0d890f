"""Serial ports of this machine."""

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

    # raised when the system refuses a setting; the library does not translate it
    _PORT_ERRORS = (OSError, ValueError, termios.error)

_READ_TIMEOUT = 0.02
_WRITE_TIMEOUT = 1.0
_WINDOWS_BUFFER = 1 << 18


def listed_ports() -> list[str]:
    """The serial ports listed by the system."""
    return sorted(port.device for port in list_ports.comports())


def open_port(name: str, port: str, baud: int) -> Serial:
    """Open `port` for `name` with exclusive access, 8 data bits, no parity, one stop bit (manual, p. 84).

    Raises DeviceNotFound if the port is absent, held by another program, not permitted or not a serial port.
    """
    try:
        opened = Serial(port, baud, timeout=_READ_TIMEOUT, write_timeout=_WRITE_TIMEOUT, exclusive=True)
    except _PORT_ERRORS as error:
        raise DeviceNotFound(f"{name} cannot be opened: {_reason(port, error)}") from error
    _set_low_latency(opened)
    return opened


def has_baud(port: Serial, baud: int) -> bool:
    """Set the baud rate of an open port; returns False if the adapter or the system does not support it."""
    try:
        port.baudrate = baud
    except _PORT_ERRORS:
        return False
    return True


def _set_low_latency(port: Serial) -> None:
    """Set the adapter's low-latency mode if supported, and enlarge the receive buffer where the default is small."""
    if sys.platform == "win32":
        port.set_buffer_size(rx_size=_WINDOWS_BUFFER)
    elif sys.platform == "linux":
        with suppress(ValueError):
            port.set_low_latency_mode(True)


def _reason(port: str, error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    # on Windows the library gives the system's error only as text, and a port in use is reported as not permitted
    windows = isinstance(error, SerialException) and number is None
    if number in (errno.EBUSY, errno.EAGAIN) or (windows and "PermissionError" in str(error)):
        return f"{port} is in use; close the program that holds it"
    if number in (errno.EACCES, errno.EPERM):
        return f"this account may not use {port}; add it to the group that owns the port (dialout, uucp)"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or (windows and "FileNotFoundError" in str(error)):
        there = ", ".join(listed_ports()) or "none"
        return f"there is no port {port}; plug in the adapter or correct the name (available: {there})"
    return f"{port} does not work as a serial port ({error}); check the name and the adapter's driver"
