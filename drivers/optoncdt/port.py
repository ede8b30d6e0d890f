"""Serial ports of this machine, and of serial device servers at `socket://HOST:PORT`."""

import errno
import socket
import sys
from contextlib import suppress
from typing import Any, cast

from serial import Serial, SerialException
from serial.tools import list_ports
from serial.urlhandler import protocol_socket

from drivers.errors import DeviceNotFound

if sys.platform == "win32":
    _PORT_ERRORS = (OSError, ValueError)
else:
    import termios

    # raised when the system refuses a setting; pyserial does not convert it to a SerialException
    _PORT_ERRORS = (OSError, ValueError, termios.error)

_READ_TIMEOUT = 0.02
_WRITE_TIMEOUT = 1.0
_WINDOWS_BUFFER = 1 << 18
_NETWORK_BUFFER = 1 << 16


NETWORK = "socket://"
"""Prefix of the address of a serial line on a network port."""


class SocketPort(protocol_socket.Serial):
    """A serial line on a network port, whose `in_waiting` is the number of received bytes. The base class only reports
    whether there are any, so a stream would be read byte by byte.
    """

    @property
    def in_waiting(self) -> int:
        """Number of received bytes; 1 once the connection has ended, so that the next read raises SerialException."""
        try:
            return len(cast(Any, self)._socket.recv(_NETWORK_BUFFER, socket.MSG_PEEK)) or 1
        except BlockingIOError:
            return 0


def listed_ports() -> list[str]:
    """The serial ports listed by the system."""
    return sorted(port.device for port in list_ports.comports())


def open_port(name: str, port: str, baud: int) -> Serial:
    """Open `port` with exclusive access, 8 data bits, no parity, one stop bit (manual, p. 84).

    `name` identifies the sensor in error messages. The baud rate and exclusive access do not apply to a network port.
    Raises DeviceNotFound if the port is absent, in use, not accessible to this account, or not a serial port.
    """
    if port.startswith(NETWORK):
        try:
            return cast(Serial, SocketPort(port, baud, timeout=_READ_TIMEOUT, write_timeout=_WRITE_TIMEOUT))
        except _PORT_ERRORS as error:
            message = "check the address, and that the device server is switched on and has no other client"
            raise DeviceNotFound(f"{name} cannot be opened: {port} does not respond ({error}); {message}") from error
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
    """On Linux, set the adapter's low-latency mode if supported; on Windows, enlarge the receive buffer."""
    if sys.platform == "win32":
        port.set_buffer_size(rx_size=_WINDOWS_BUFFER)
    elif sys.platform == "linux":
        with suppress(ValueError):
            port.set_low_latency_mode(True)


def _reason(port: str, error: Exception) -> str:
    number = error.errno if isinstance(error, OSError) else None
    # on Windows pyserial reports the system's error only as text, and a port in use as PermissionError
    windows = isinstance(error, SerialException) and number is None
    if number in (errno.EBUSY, errno.EAGAIN) or (windows and "PermissionError" in str(error)):
        return f"{port} is in use; close the program that holds it"
    if number in (errno.EACCES, errno.EPERM):
        return f"this account may not use {port}; add it to the group that owns the port (dialout, uucp)"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or (windows and "FileNotFoundError" in str(error)):
        there = ", ".join(listed_ports()) or "none"
        return f"there is no port {port}; plug in the adapter or correct the name (available: {there})"
    return f"{port} does not work as a serial port ({error}); check the name and the adapter's driver"
