"""What a DAQmx driver and its gRPC server refuse, before it is put on the wire."""

from nidaqmx.error_codes import DAQmxErrors


class DaqmxFailure(Exception):
    """An error of the driver. A write tells how many samples per channel it has written before."""

    def __init__(self, code: DAQmxErrors, text: str, *, samples_written: int = 0) -> None:
        super().__init__(text)
        self.code = code
        self.samples_written = samples_written


class SessionExists(Exception):
    """A new session was asked for under a name that is taken."""


class SessionMissing(Exception):
    """An existing session was asked for under a name that nobody has."""


class NotEmulated(Exception):
    """The real driver could do it; this one says so instead of doing something else."""
