"""Base classes of the errors that this software raises deliberately."""

import errno
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, time
from enum import StrEnum
from numbers import Number
from pathlib import Path
from typing import ClassVar, cast


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

    def __reduce__(self) -> tuple[object, ...]:
        """Another process receives the same message, whatever the constructor of a subclass needs."""
        return _restored, (type(self), str(self)), self.__dict__


def _restored(kind: type[RockbenchError], text: str) -> RockbenchError:
    return kind.__new__(kind, text)


class InvalidInput(RockbenchError, ValueError):
    """Error: a value is refused.

    `item` names the key, flag or argument; `value` the input; `allowed` describes valid input.
    """

    error_code = "invalid_input"

    def __init__(self, item: str, value: object, allowed: str) -> None:
        super().__init__(f"{item} = {_shown(value)} is refused: {allowed}")
        self.item = item
        self.value = value
        self.allowed = allowed

    @property
    def cause(self) -> Cause:
        """Error code, with the item as subject."""
        return Cause(self.error_code, self.item)


def as_text(value: object) -> str:
    """A refused value as text: an object that is neither a number nor a path or date is described by its type, since
    its representation in Python names no quantity.
    """
    if value is None or isinstance(value, str | Number | Path | date | time):
        return str(value)
    return f"an object of type {type(value).__name__}"


def _shown(value: object) -> str:
    """A refused value in a message: text in quotes, the items of a list each on their own."""
    match value:
        case list() | tuple():
            inner = ", ".join(_shown(each) for each in cast("Sequence[object]", value))
            return f"[{inner}]" if isinstance(value, list) else f"({inner})"
        case str() | Path() | date() | time():
            return repr(as_text(value))
        case dict():
            return "a table"
        case _:
            return as_text(value)


_OF_DISK = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG})


def cause_of(error: BaseException) -> Cause:
    """Cause of any error, including disk errors of the operating system."""
    if isinstance(error, RockbenchError):
        return error.cause
    if isinstance(error, MemoryError):
        return Cause(CauseCode.MEMORY)
    return Cause(CauseCode.DISK if isinstance(error, OSError) and error.errno in _OF_DISK else CauseCode.UNKNOWN)
