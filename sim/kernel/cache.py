"""Folder of the kernel's compiled code, named after a hash of its sources and writable only by this user.

By itself, numba checks only the source file of the compiled function, so that a caller in another file would keep an
outdated callee, and uses a folder in the user's home if the folder of the source file is not writable. Here, the name
of every folder contains the hash of all sources. The cached files are pickles, which execute code when loaded;
therefore a folder to which others can write is not used.
"""

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl
    import grp
    import pwd

KEPT = 6
"""Number of unused folders of other kernel versions that are kept, so that a return to them needs no recompilation."""

PREFIX = "rockbench-"
IN_USE = "in-use"
"""File that every process using the folder keeps open; its modification time is that of the last use."""

TOLD = "ROCKBENCH_KERNEL_IN_MEMORY"
"""Environment variable that keeps child processes from repeating the notice on standard error."""


KERNEL = Path(__file__).parent


class KernelCache:
    """Folder for compiled code: chosen once, and abandoned for compilation in memory if it cannot be used.

    given : folder that the user set for numba's caches; if empty, the installation's or the user's cache folder is
    used.
    versions : versions and settings of the compiler, which are included in the hash.
    sources : folder of the source files of the compiled functions, that of the kernel or another one.
    """

    def __init__(self, given: str, versions: Sequence[object], sources: Path = KERNEL) -> None:
        self._sources = sources
        self._stamp = _stamp(self._sources)
        self._folder: Path | None = None
        self._handle: int | None = None
        self.name = ""
        """Name of the folder, which contains the hash; empty without source files."""
        if not self._stamp:
            # for example in an archive: numba's locator needs files, and without source files no change can be detected
            self.give_up(f"{self._sources} is not a folder of source files")
            return
        content = [(name, (self._sources / name).read_bytes()) for name, *_ in self._stamp]
        self.name = name = PREFIX + hashlib.sha256(repr([content, *versions, self._sources]).encode()).hexdigest()[:12]
        reasons: list[str] = []
        for base in [Path(given).absolute()] if given else _places(self._sources):
            try:
                self._folder, self._handle = _claim(base, name)
                return
            except OSError as error:
                reasons.append(f"{error.filename or base} {error.strerror or error}")
                if isinstance(error, NotPrivate) and (base / name).exists():
                    _say(f"the compiled kernel in {base / name} is not loaded: {reasons[-1]}; remove this folder")
        self.give_up("; ".join(reasons) or "there is no home folder")

    def folder(self) -> Path | None:
        """Folder for loading and saving compiled code; None for compilation in memory."""
        if self._folder is not None and _stamp(self._sources) != self._stamp:
            self.give_up(f"the sources in {self._sources} changed while they were loaded")
        return self._folder

    def give_up(self, why: str) -> None:
        """Switch to compilation in memory, with one notice on standard error for this process and its children."""
        self._folder = None
        self.release()
        _say(
            f"the kernel is compiled in memory, which takes about ten seconds at every start: {why};"
            " set NUMBA_CACHE_DIR to a folder to which only you can write"
        )

    def release(self) -> None:
        """Close the file whose lock protects the folder from removal."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


class NotPrivate(OSError):
    """Error: other users can write to the folder."""


def _say(what: str) -> None:
    if TOLD not in os.environ and sys.stderr is not None:  # pyright: ignore[reportUnnecessaryComparison]
        os.environ[TOLD] = "1"
        print(f"rockbench: {what}", file=sys.stderr, flush=True)


def _stamp(folder: Path) -> list[tuple[str, int, int]]:
    # compared before each function is loaded: an update of the sources during loading would mix two versions
    with suppress(OSError), os.scandir(folder) as entries:
        sources = [entry for entry in entries if entry.name.endswith(".py")]
        return sorted((entry.name, entry.stat().st_mtime_ns, entry.stat().st_size) for entry in sources)
    return []


def _places(sources: Path) -> list[Path]:
    places = [sources / "__pycache__"]
    with suppress(RuntimeError):  # a user without a home folder
        home = Path.home()
        if sys.platform == "win32":
            user = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
        elif sys.platform == "darwin":
            user = home / "Library" / "Caches"
        else:
            user = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
        if user.is_absolute():
            places.append(user / "rockbench")
    return places


def _claim(base: Path, name: str) -> tuple[Path, int]:
    """Create or reuse the folder `name` in `base`. Returns it and the handle of the file that prevents its removal.

    Raises OSError with the reason if this fails.
    """
    existing = base
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    _require_private(existing.resolve(), parents=True)
    base.mkdir(parents=True, exist_ok=True)
    folder = base / name
    for _ in range(10):
        new = False
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
            new = True
        try:
            _require_private(folder, parents=False)
            with tempfile.TemporaryFile(dir=folder):
                pass
            handle = os.open(folder / IN_USE, os.O_RDWR | os.O_CREAT, 0o600)
        except FileNotFoundError:
            continue  # another process is removing it
        if _hold(handle, folder / IN_USE):
            if new:
                _remove_old(base, folder)
            return folder, handle
        os.close(handle)
    raise OSError(None, "is repeatedly removed by another process", str(folder))


def _hold(handle: int, path: Path) -> bool:
    """Mark the open file as in use. Returns False if `path` is no longer this file."""
    with suppress(OSError):  # without locks, no folder is removed either
        if sys.platform != "win32":
            fcntl.flock(handle, fcntl.LOCK_SH)
    with suppress(OSError):
        os.utime(path)
        return os.path.samestat(os.fstat(handle), path.stat())
    return False


def _remove_old(base: Path, own: Path) -> None:
    """Remove the unused folders in `base`, except `own` and the `KEPT` most recently used ones."""
    with suppress(OSError):
        others = [(_last_use(path), path) for path in base.glob(f"{PREFIX}*") if path != own]
        for _, path in sorted(others, reverse=True)[KEPT:]:
            _remove_unused(path)


def _last_use(folder: Path) -> float:
    with suppress(OSError):
        return (folder / IN_USE).stat().st_mtime
    return 0.0


def _remove_unused(folder: Path) -> None:
    with suppress(OSError):
        handle = os.open(folder / IN_USE, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            if sys.platform != "win32":
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder)
        finally:
            os.close(handle)
        if sys.platform == "win32":
            # Windows can neither remove an open file nor rename its folder
            (folder / IN_USE).unlink()
            shutil.rmtree(folder)


def _require_private(path: Path, *, parents: bool) -> None:
    """Raise OSError unless `path` is a folder that belongs to this user or, with `parents`, to root; also if other
    users can write to it or, with `parents`, to a folder above it.

    Nothing is checked on Windows, whose user folders are private by default.
    """
    if sys.platform == "win32":
        return
    info = path.lstat()
    us = os.geteuid()
    if not stat.S_ISDIR(info.st_mode):
        raise OSError(None, "is not a folder", str(path))
    if info.st_uid not in ((us, 0) if parents else (us,)):
        raise OSError(None, "is owned by another user", str(path))
    for each in (path, *path.parents) if parents else (path,):
        if _others_write(each.stat(), parents):
            raise NotPrivate(None, "can be written by others", str(each))


def _others_write(info: os.stat_result, is_parent: bool) -> bool:
    if sys.platform == "win32":
        return False
    if is_parent and info.st_mode & stat.S_ISVTX:
        return False  # sticky bit: others cannot replace the contents, which are checked separately
    if info.st_mode & stat.S_IWOTH:
        return True
    return bool(info.st_mode & stat.S_IWGRP) and not (is_parent and _own_group(info.st_gid))


def _own_group(gid: int) -> bool:
    """Whether a group is this user's private group, as on systems where new folders are group-writable."""
    if sys.platform == "win32":
        return True
    with suppress(KeyError):
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(gid)
        return user.pw_gid == gid and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
    return False
