"""Unfinished results: temporary files and folders that a process must remove, however it ends.

The code that creates such a file or folder removes it, or renames it when it is complete. The list here is needed only
where no `finally` runs: when an interrupted process ends because its main thread does not respond (see
`bench.app.cli.interrupt`). A second list contains the complete results, which are listed in the message of a later
interrupt, and a third one the computations that a signal has broken off, whose objects are kept.
"""

import os
import shutil
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import gettempdir
from types import FrameType
from uuid import uuid4

from sim.errors import InvalidInput, RockbenchError

HELD, PAUSE = 1.0, 0.05
"""Longest time for which another program may hold a file that is to be renamed, and pause between the attempts to
rename it [s].
"""

LLVM = "llvmlite.binding.executionengine"
CALLED_BY_LLVM = ("_raw_object_cache_notify", "_raw_object_cache_getbuffer")
"""Functions of llvmlite, in the module `LLVM`, that native code calls to store and load compiled code."""

_paths: set[Path] = set()
_reserved: set[Path] = set()
_names: dict[Path, Path] = {}
"""Final name of every result that has been renamed or is about to be renamed, by its temporary name."""
_broken_off: list[FrameType] = []


def break_off(frame: FrameType | None, error: Callable[[], BaseException]) -> None:
    """For a signal handler called in `frame`: raise `error()`, and keep all objects of the computation.

    The exception may be raised while a library hands over native memory: llvmlite links two compiled modules in native
    code and marks the second one as consumed in the next statement. A destructor called between the two frees that
    memory twice, which ends the process with a segmentation fault.

    Returns without an exception while native code waits for the answer of a Python function: ctypes would only report
    the exception, and LLVM would take the missing answer for a module without code, whose functions have the address 0.
    """
    if frame is not None:
        caller: FrameType | None = frame
        while caller is not None:
            if caller.f_code.co_name in CALLED_BY_LLVM and caller.f_globals.get("__name__") == LLVM:
                return
            caller = caller.f_back
        # a kept frame keeps its local variables, and its callers
        _broken_off.append(frame)
    raise error()


@contextmanager
def unfinished(path: Path) -> Generator[Path]:
    """Context manager for the creation of a file or folder at `path`: removes it at exit unless it has been renamed, or
    marked as complete by `whole`.
    """
    _names.pop(path, None)
    _paths.add(path)
    try:
        yield path
    finally:
        _discard(path)
        _paths.discard(path)


@contextmanager
def temporary_folder() -> Generator[Path]:
    """Context manager that creates an empty folder for files of this process, and removes the folder with its files at
    the end.
    """
    with unfinished(Path(gettempdir(), f"rockbench-{uuid4().hex}")) as folder:
        folder.mkdir(mode=0o700)
        yield folder


def replace(source: Path, target: Path) -> None:
    """Rename a complete file to its final name, replacing any existing file.

    On Windows a scanner or an indexer may briefly hold either file, so the rename is retried for `HELD` seconds.
    Raises OSError.
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


def finish(temporary: Path, target: Path) -> None:
    """Rename the complete result `temporary` to its final name. Raises OSError."""
    # listed before the rename, because an interrupt may come between any two instructions; `completed` checks whether
    # the file has been renamed
    _names[temporary] = target
    replace(temporary, target)


def completed() -> list[Path]:
    """Paths of the results completed since the last `forget_completed()`. They are kept even after an interrupt."""
    return [path for temporary, path in tuple(_names.items()) if path == temporary or _is_renamed(temporary, path)]


def forget_completed() -> None:
    """Start a new list of completed results."""
    _names.clear()


def write_new(path: Path, write: Callable[[Path], None], *, overwrite: bool = False) -> None:
    """Write a file under a temporary name in the folder of `path`, and rename it when it is complete.

    Raises InvalidInput if `path` exists and `overwrite` is False, or if its folder does not exist, and RockbenchError
    if the file cannot be written.
    """
    if path.exists() and not overwrite:
        raise InvalidInput("file", str(path), "the file exists and is never overwritten; choose another name")
    if not path.parent.is_dir():
        raise InvalidInput("file", str(path), "the folder does not exist; create it first")
    # the temporary name keeps the suffix, from which a writer may choose the format
    try:
        with unfinished(path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")) as temporary:
            write(temporary)
            finish(temporary, path)
    except OSError as error:
        raise RockbenchError(f"{path} could not be written ({error.strerror or error}): check the disk") from error


def whole(path: Path) -> None:
    """Mark the file at `path`, which has its final name, as complete: it is kept."""
    _names[path] = path


def reserve(folder: Path) -> None:
    """Register `folder`, which was created for results: if the process ends without running `finally`, the folder and
    its parent folder are removed if they are empty.
    """
    _reserved.add(folder)


def remove_at_interrupt(path: Path) -> None:
    """Register a file or folder that a library removes at a normal end of the process only."""
    _paths.add(path)


def remove_unfinished() -> None:
    """Remove all unfinished files and folders; called from any thread just before the process exits."""
    for path in tuple(_paths):
        _discard(path)
    for folder in tuple(_reserved):
        with suppress(OSError):
            # a folder that is not empty is kept
            folder.rmdir()
            folder.parent.rmdir()


def _is_renamed(temporary: Path, path: Path) -> bool:
    return not temporary.exists() and path.exists()


def _discard(path: Path) -> None:
    """Remove an unfinished result; a complete one has another name, or has been marked by `whole`."""
    if _names.get(path) == path or not path.exists():
        return
    # otherwise `completed` would take an older file with the final name for the result
    _names.pop(path, None)
    with suppress(OSError):
        _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir():
        # a second pass removes files created by another thread during the first
        shutil.rmtree(path, ignore_errors=True)
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
