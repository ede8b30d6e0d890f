"""The family of errors that this software raises on purpose."""

import errno
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar


class CauseCode(StrEnum):
    """Causes of the end of a run that are no error of a type of its own."""

    UNKNOWN = "unknown"
    REQUEST = "request"
    """Somebody asked for the end."""
    CLIENT_LOST = "client_lost"
    DECLINED = "declined"
    """The operator did not do what was asked for."""
    LIMIT = "limit"
    RESIDUAL = "residual"
    """The live twin's residual exceeded its limit."""
    SAFETY_INPUT = "safety_input"
    DISK = "disk"


@dataclass(frozen=True)
class Cause:
    """Why a run ended or was refused: the `error_code` of an error, or a `CauseCode`; advice depends on it alone.

    `subject` is what it concerns: the quantity of a limit, the names of safety inputs, the item of a value.
    """

    code: str = CauseCode.UNKNOWN
    subject: str = ""


UNKNOWN = Cause()


class RockbenchError(Exception):
    """What happened, what was refused and what to do, in one line a person can act on.

    `error_code` names the type to programs (docs/errors.md); a type without its own has that of its parent.
    """

    error_code: ClassVar[str] = "error"

    @property
    def cause(self) -> Cause:
        """The code, and what it concerns."""
        return Cause(self.error_code)


class InvalidInput(RockbenchError, ValueError):
    """A value that was refused before anything started.

    `item` names the key, flag or argument; `value` is what was given; `allowed` says what would do.
    """

    error_code = "invalid_input"

    def __init__(self, item: str, value: object, allowed: str) -> None:
        super().__init__(f"{item} = {value!r} is refused: {allowed}")
        self.item = item
        self.value = value
        self.allowed = allowed

    @property
    def cause(self) -> Cause:
        """The code, and the item."""
        return Cause(self.error_code, self.item)


_OF_DISK = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG})


def cause_of(error: BaseException) -> Cause:
    """The cause that any error is: that of ours, and of what the system reports of a disk."""
    if isinstance(error, RockbenchError):
        return error.cause
    return Cause(CauseCode.DISK if isinstance(error, OSError) and error.errno in _OF_DISK else CauseCode.UNKNOWN)
