"""Errors of instruments. When a rig raises one, its output is at zero or being set to zero."""

from collections.abc import Sequence

from sim.errors import Cause, CauseCode, RockbenchError


class RigError(RockbenchError):
    """An instrument could not carry out a command.

    `code` is the error code of the instrument's own driver, if any.
    """

    error_code = "rig"

    def __init__(self, text: str, code: int | None = None) -> None:
        super().__init__(text if code is None else f"{text} (code {code})")
        self.code = code


class DriveUnderflow(RigError):
    """The output ran out of samples: more were due than had been written."""

    error_code = "drive_underflow"


class InputOverflow(RigError):
    """The inputs were read too late, and unread samples were overwritten."""

    error_code = "input_overflow"


class DeviceTimeout(RigError):
    """A device did not respond, or did not complete an operation, in time."""

    error_code = "device_timeout"


class ConnectionLost(RigError):
    """The connection to a device was lost."""

    error_code = "connection_lost"


class DeviceNotFound(RigError):
    """A device, its driver or its port is missing, unsuitable, or held by another program."""

    error_code = "device_not_found"


class SafetyInputOpen(RigError):
    """The safety inputs named in `inputs` are open: arming is refused, and the output of an armed rig is cut."""

    error_code = CauseCode.SAFETY_INPUT

    def __init__(self, text: str, inputs: Sequence[str]) -> None:
        super().__init__(text)
        self.inputs = tuple(inputs)

    @property
    def cause(self) -> Cause:
        """Error code, with the names of the inputs as subject."""
        return Cause(self.error_code, ", ".join(self.inputs))


class SafetyInputOpened(SafetyInputOpen):
    """The inputs opened after the rig was armed, before its first block; the enable line was cut."""


class EnableLineCut(RigError):
    """Arming is refused because the enable line was cut meanwhile. Further errors may be appended to the text."""

    text = "the run cannot be prepared: the enable line was cut during the preparation"

    def __init__(self) -> None:
        super().__init__(self.text)


class BackendFault(RigError):
    """The rig backend `backend` returned an invalid value, or raised an exception that a rig must not raise."""

    error_code = "backend"

    def __init__(self, backend: str, what: str) -> None:
        super().__init__(f"the rig backend {backend} {what}; correct the backend")
        self.backend = backend

    @property
    def cause(self) -> Cause:
        """Error code, with the name of the backend as subject."""
        return Cause(self.error_code, self.backend)
