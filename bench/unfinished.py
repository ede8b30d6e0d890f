"""Results in the making: temporary files and folders that a process must not leave behind, however it ends.

Whoever makes one removes it, or renames it when it is whole. The list here is for the one ending that runs no
`finally`: an interrupted process whose main thread does not answer, see `bench.cli.interrupt`.
"""

import shutil
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

_paths: set[Path] = set()
_reserved: set[Path] = set()


@contextmanager
def unfinished(path: Path) -> Generator[Path]:
    """Within, a file or folder may be made at `path`; at the end it is removed, unless it was renamed or is `whole`."""
    _paths.add(path)
    try:
        yield path
    finally:
        if path in _paths:
            with suppress(OSError):
                _remove(path)
            _paths.discard(path)


def whole(path: Path) -> None:
    """What was made at `path` is a result: it stays."""
    _paths.discard(path)


def reserve(folder: Path) -> None:
    """`folder` was made for results to come: an ending that runs no `finally` removes it if it is still empty."""
    _reserved.add(folder)


def remove_unfinished() -> None:
    """Remove every file and folder in the making; from any thread, just before the process is ended."""
    for path in tuple(_paths):
        with suppress(OSError):
            _remove(path)
    for folder in tuple(_reserved):
        with suppress(OSError):
            # neither is removed while anything is in it
            folder.rmdir()
            folder.parent.rmdir()


def _remove(path: Path) -> None:
    if path.is_dir():
        # a second time for what another thread has put there during the first
        shutil.rmtree(path, ignore_errors=True)
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
