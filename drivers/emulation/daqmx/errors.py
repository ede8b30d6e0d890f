"""Errors of the emulated DAQmx driver and its gRPC server, as raised before they are sent to a client."""

from nidaqmx.error_codes import DAQmxErrors


class DaqmxFailure(Exception):
    """An error of the driver; after a write, with the number of samples per channel written before it."""

    def __init__(self, code: DAQmxErrors, text: str, *, samples_written: int = 0) -> None:
        super().__init__(text)
        self.code = code
        self.samples_written = samples_written


class SessionExists(Exception):
    """A new session was requested under an existing name."""


class SessionMissing(Exception):
    """An existing session was requested under an unknown name."""


class NotEmulated(Exception):
    """A function of the real driver that is not emulated."""
