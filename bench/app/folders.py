"""Folders for results: a new one for each run, checked before the start so that nothing is overwritten."""

import tempfile
from collections.abc import Container, Iterable
from contextlib import suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.results import FILE, SUMMARY
from bench.unfinished import reserve
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.protocol import Protocol


def result_names(protocol: "Protocol[Any]") -> tuple[str, ...]:
    """Names of all files that a run of `protocol` may write to its folder."""
    return (FILE, *protocol.figures, SUMMARY, *protocol.files)


def default_folder(protocol: str, now: datetime) -> Path:
    """Default results folder `runs/<protocol>-<date>T<time>`; the time has hyphens, as some systems forbid colons."""
    return Path("runs", f"{protocol}-{now:%Y-%m-%dT%H-%M-%S}")


def make_folder(first: Path, taken: Container[Path] = ()) -> Path:
    """Create a unique folder: `first`, or if that exists or is `taken`, the same name with -2, -3 and so on.

    Concurrent processes get different folders. Raises InvalidInput if none can be created.
    """
    for number in count(1):
        folder = first if number == 1 else first.with_name(f"{first.name}-{number}")
        if folder in taken:
            continue
        try:
            # another process may have removed an empty parent in the meantime
            for _ in range(100):
                with suppress(FileNotFoundError):
                    _make_parent(folder)
                    folder.mkdir()
                    reserve(folder)
                    return folder
        except FileExistsError:
            continue
        except OSError as error:
            raise InvalidInput("--out", str(folder), f"the folder cannot be created: {error.strerror}") from None
        break
    raise InvalidInput("--out", str(first), f"another program repeatedly removes {first.parent}; choose another folder")


def _make_parent(folder: Path) -> None:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InvalidInput("--out", str(folder), f"{folder.parent} is a file; choose a folder") from None


def remove_unused(folder: Path) -> None:
    """Remove a folder created by `make_folder` if it is empty, and then its parent if that is empty."""
    with suppress(OSError):
        folder.rmdir()
        folder.parent.rmdir()


def checked_folder(named: Path | None, default: Path, results: Iterable[str]) -> Path:
    """Folder of a run with these `results`: the `named` one, or the `default` for `make_folder`, which may exist with
    the results of a run that began in the same second. Raises InvalidInput if they cannot be written.
    """
    if named is None:
        check_folder(default, ())
        return default
    check_folder(named, results)
    return named


def check_folder(folder: Path, results: Iterable[str]) -> None:
    """Check that the `results` of a run can be written to a folder, without creating it.

    Raises InvalidInput naming the reason if they cannot be written.
    """
    existing = folder
    try:
        for name in results:
            if (folder / name).exists():
                raise InvalidInput(
                    "--out",
                    str(folder),
                    f"it already contains {name}; results are never overwritten, so choose another folder",
                )
        while not existing.exists() and existing != existing.parent:
            existing = existing.parent
        if not existing.is_dir():
            raise InvalidInput("--out", str(folder), f"{existing} is a file; choose a folder")
        # a trial file, because permission bits are not reliable on every file system
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise InvalidInput("--out", str(folder), f"{existing} cannot be written: {error.strerror}") from None
