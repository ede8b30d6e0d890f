"""The family of errors that this software raises on purpose."""

from typing import ClassVar


class RockbenchError(Exception):
    """What happened, what was refused and what to do, in one line a person can act on.

    `error_code` names the type to programs (docs/errors.md); a type without its own has that of its parent.
    """

    error_code: ClassVar[str] = "error"


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
