"""Writes a result under its final name only when it is whole, and never over another unless that is asked for."""

import os
from collections.abc import Callable
from pathlib import Path

from bench.unfinished import unfinished
from sim.errors import InvalidInput, RockbenchError


def write_new(path: Path, write: Callable[[Path], None], *, overwrite: bool = False) -> None:
    """Let `write` fill a temporary file beside `path`, then give it that name.

    Raises InvalidInput when `path` exists, unless it may `overwrite` it, or its folder does not, RockbenchError when
    the disk fails.
    """
    if path.exists() and not overwrite:
        raise InvalidInput("file", str(path), "it exists and is never overwritten; name another")
    if not path.parent.is_dir():
        raise InvalidInput("file", str(path), "its folder does not exist; create it first")
    # the temporary name keeps the suffix, from which a writer may choose the format
    try:
        with unfinished(path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")) as temporary:
            write(temporary)
            os.replace(temporary, path)
    except OSError as error:
        raise RockbenchError(f"{path} could not be written ({error.strerror or error}): see to the disk") from error
