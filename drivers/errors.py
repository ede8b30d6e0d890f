"""What goes wrong with instruments. Whatever is raised here, the output is at zero or on its way there."""

from collections.abc import Sequence

from sim.errors import Cause, CauseCode, RockbenchError


class RigError(RockbenchError):
    """The rig could not do what was asked; its output is at zero or on its way there.

    `code` is the number that the instrument's own driver gave, where it gave one.
    """

    error_code = "rig"

    def __init__(self, text: str, code: int | None = None) -> None:
        super().__init__(text if code is None else f"{text} (code {code})")
        self.code = code


class DriveUnderflow(RigError):
    """The output ran out of samples: more were asked to be played than were written."""

    error_code = "drive_underflow"


class InputOverflow(RigError):
    """Inputs were read too late: samples that nobody fetched were overwritten."""

    error_code = "input_overflow"


class DeviceTimeout(RigError):
    """A device did not answer in time."""

    error_code = "device_timeout"


class ConnectionLost(RigError):
    """A device that was there is gone."""

    error_code = "connection_lost"


class DeviceNotFound(RigError):
    """A device, its driver or its port is not there, or somebody else holds it."""

    error_code = "device_not_found"


class SafetyInputOpen(RigError):
    """Safety inputs, named by `inputs`, are not good: nothing is armed, and what was armed is cut."""

    error_code = CauseCode.SAFETY_INPUT

    def __init__(self, text: str, inputs: Sequence[str]) -> None:
        super().__init__(text)
        self.inputs = tuple(inputs)

    @property
    def cause(self) -> Cause:
        """The code, and the names of the inputs."""
        return Cause(self.error_code, ", ".join(self.inputs))
