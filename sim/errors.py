"""Base classes of the errors that this software raises deliberately."""

import errno
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar


class CauseCode(StrEnum):
    """Reasons for the end of a run that can occur without a RockbenchError."""

    UNKNOWN = "unknown"
    REQUEST = "request"
    """A person or a client program requested the end of the run."""
    CLIENT_LOST = "client_lost"
    DECLINED = "declined"
    """The operator declined or did not complete a task."""
    LIMIT = "limit"
    RESIDUAL = "residual"
    """The live twin's residual exceeded its limit."""
    SAFETY_INPUT = "safety_input"
    DISK = "disk"
    MEMORY = "memory"
    """The computer is out of memory."""


class Interruption(Exception):
    """Exception that ends a run early; it does not indicate an error in the code that raises it."""


@dataclass(frozen=True)
class Cause:
    """Cause of the end or refusal of a run: `code` is the `error_code` of an error, or a `CauseCode`. The advice to the
    operator depends only on the cause.

    `subject` is the item concerned: the quantity of a limit, the names of safety inputs, the name of a value, the kind
    of a request ("stop", "abort" or "halt").
    """

    code: str = CauseCode.UNKNOWN
    subject: str = ""


UNKNOWN = Cause()


class RockbenchError(Exception):
    """Error with a one-line message that states the problem, the rejected input and the remedy.

    `error_code` identifies the type to programs (docs/errors.md); a type that does not define it inherits that of its
    parent.
    """

    error_code: ClassVar[str] = "error"

    @property
    def cause(self) -> Cause:
        """The error's code and subject."""
        return Cause(self.error_code)


class InvalidInput(RockbenchError, ValueError):
    """Error: a value is refused.

    `item` names the key, flag or argument; `value` the input; `allowed` describes valid input.
    """

    error_code = "invalid_input"

    def __init__(self, item: str, value: object, allowed: str) -> None:
        super().__init__(f"{item} = {value!r} is refused: {allowed}")
        self.item = item
        self.value = value
        self.allowed = allowed

    @property
    def cause(self) -> Cause:
        """Error code, with the item as subject."""
        return Cause(self.error_code, self.item)


_OF_DISK = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG})


def cause_of(error: BaseException) -> Cause:
    """Cause of any error, including disk errors of the operating system."""
    if isinstance(error, RockbenchError):
        return error.cause
    if isinstance(error, MemoryError):
        return Cause(CauseCode.MEMORY)
    return Cause(CauseCode.DISK if isinstance(error, OSError) and error.errno in _OF_DISK else CauseCode.UNKNOWN)
