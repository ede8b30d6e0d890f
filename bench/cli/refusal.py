"""Errors as the command line reports them: a line for a person, with --json an object for a program too."""

import json
import sys
from typing import Any, Literal, TextIO

from bench.cli.words import one_line
from sim.errors import InvalidInput, RockbenchError

Code = Literal[
    "usage", "system", "interrupted", "run_failed", "run_aborted", "check_failed", "replay_differs", "damaged_file"
]
"""Codes of errors that are no RockbenchError, whose types bring their own as `error_code`."""

_objects: TextIO | None = None
"""Stream for the error of a command with --json; None for every other command."""


def reply_in_json(stream: TextIO | None) -> None:
    """From now on `fail` prints its object on `stream`, or, for None, none."""
    global _objects
    _objects = stream


def warn(message: object) -> None:
    """One line on standard error: a defect in spite of which the command went on."""
    print(f"rockbench: warning: {one_line(str(message))}", file=sys.stderr)


def tell(message: object) -> None:
    """One line on standard error, whatever the message holds."""
    print(f"rockbench: error: {one_line(str(message))}", file=sys.stderr)


def fail(error: BaseException | str, code: Code | None = None) -> None:
    """Report the error that ends a command which has printed no result: a line on standard error and, with --json, one
    object with the key "error" on standard output.
    """
    global _objects
    tell(error)
    stream, _objects = _objects, None
    if stream is not None:
        print(json.dumps({"error": error_object(error, code)}), file=stream, flush=True)


def error_object(error: BaseException | str, code: Code | None = None) -> dict[str, Any]:
    """An error for a program, ready for JSON: `code`, `message`, and `item`, `value`, `remedy` where they are known.

    The code is that of the error's type; `code` applies where the error is no RockbenchError.
    """
    known = isinstance(error, InvalidInput)
    return {
        "code": error.error_code if isinstance(error, RockbenchError) else code or "system",
        "message": one_line(str(error)),
        "item": error.item if known else None,
        "value": one_line(str(error.value)) if known else None,
        "remedy": error.allowed if known else None,
    }
