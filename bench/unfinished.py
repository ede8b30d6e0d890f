"""Unfinished results: temporary files and folders that a process must remove, however it ends.

The creator removes each one, or renames it when complete. The list here serves the one ending that runs no `finally`:
an interrupted process whose main thread does not respond, see `bench.app.cli.interrupt`.
"""

import os
import shutil
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import gettempdir
from uuid import uuid4

from sim.errors import InvalidInput, RockbenchError

HELD, PAUSE = 1.0, 0.05
"""Time for which another program may hold a file that is renamed, and the pause between attempts [s]."""

_paths: set[Path] = set()
_reserved: set[Path] = set()


@contextmanager
def unfinished(path: Path) -> Generator[Path]:
    """Context manager to create a file or folder at `path`: removes it at exit unless it was renamed or is `whole`."""
    _paths.add(path)
    try:
        yield path
    finally:
        if path in _paths:
            with suppress(OSError):
                _remove(path)
            _paths.discard(path)


@contextmanager
def temporary_folder() -> Generator[Path]:
    """Context manager for an empty folder for files of this process; removes both at the end."""
    with unfinished(Path(gettempdir(), f"rockbench-{uuid4().hex}")) as folder:
        folder.mkdir(mode=0o700)
        yield folder


def replace(source: Path, target: Path) -> None:
    """Rename a complete file to its name, replacing one that has it.

    On Windows a scanner or an indexer may hold either for a moment: it is tried again for `HELD` seconds. Raises
    OSError.
    """
    end = time.monotonic() + HELD
    while True:
        try:
            os.replace(source, target)
        except PermissionError:
            if time.monotonic() >= end:
                raise
            time.sleep(PAUSE)
        else:
            return


def write_new(path: Path, write: Callable[[Path], None], *, overwrite: bool = False) -> None:
    """Writes a file under a temporary name in the folder of `path` and renames it when it is complete.

    Raises InvalidInput when `path` exists and `overwrite` is False, or when its folder does not exist; RockbenchError
    when the disk fails.
    """
    if path.exists() and not overwrite:
        raise InvalidInput("file", str(path), "it exists and is never overwritten; name another")
    if not path.parent.is_dir():
        raise InvalidInput("file", str(path), "its folder does not exist; create it first")
    # the temporary name keeps the suffix, from which a writer may choose the format
    try:
        with unfinished(path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")) as temporary:
            write(temporary)
            replace(temporary, path)
    except OSError as error:
        raise RockbenchError(f"{path} could not be written ({error.strerror or error}): check the disk") from error


def whole(path: Path) -> None:
    """Mark the file at `path` as complete: it is kept."""
    _paths.discard(path)


def reserve(folder: Path) -> None:
    """Register `folder`, created for results: an ending that runs no `finally` removes it if it is still empty."""
    _reserved.add(folder)


def remove_unfinished() -> None:
    """Remove all unfinished files and folders; called from any thread just before the process exits."""
    for path in tuple(_paths):
        with suppress(OSError):
            _remove(path)
    for folder in tuple(_reserved):
        with suppress(OSError):
            # a folder that is not empty is kept
            folder.rmdir()
            folder.parent.rmdir()


def _remove(path: Path) -> None:
    if path.is_dir():
        # a second pass removes files created by another thread during the first
        shutil.rmtree(path, ignore_errors=True)
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
