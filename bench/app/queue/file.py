"""The queue file, replaced atomically at each change and owned by one program at a time."""

import json
import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from bench.app.queue.queue import Queued, Stage
from bench.bounded import read_bounded, require_shallow
from bench.config.validation import dotted, validated
from bench.unfinished import replace
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from sim.process_lock import LockHeld, ProcessLock

ITEM = "queue file"
FORMAT, VERSION = "rocking-bench queue", 1
REMEDY = "add the test there, close that program first, or choose another file"
LEFT = "abandoned during its run: see the status in its results folder"


class _Tests(Parameters):
    tests: tuple[Queued, ...] = quantity((), "", "the tests in order")


class QueueFile:
    """Reads and writes a queue file, and detects changes by another program."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._known: str | None = None

    def read(self) -> tuple[Queued, ...]:
        """The tests in the file; empty if there is no file yet. A test abandoned during its run is marked as failed.
        Raises InvalidInput naming file and key.
        """
        text = self._text()
        if text is None:
            self._known = None
            return ()
        try:
            content: Any = json.loads(text)
            require_shallow(content)
        except (ValueError, RecursionError) as error:
            raise InvalidInput(ITEM, str(self.path), f"the file cannot be read as JSON: {error}") from None
        data = cast(dict[str, Any], content) if isinstance(content, dict) else {}
        if data.get("format") != FORMAT or data.get("format_version") != VERSION:
            raise InvalidInput(ITEM, str(self.path), f'it must have "format": "{FORMAT}", "format_version": {VERSION}')
        rest = {key: value for key, value in data.items() if key not in ("format", "format_version")}
        tests = validated(_Tests, rest, lambda where: f"{self.path.name}: {dotted(where)}").tests
        self._known = text
        left = {"stage": Stage.FAILED, "outcome": LEFT}
        return tuple(test.model_copy(update=left) if test.stage is Stage.RUNNING else test for test in tests)

    def write(self, tests: Sequence[Queued]) -> None:
        """Replace the file atomically. Raises InvalidInput if this fails or another program has changed the file."""
        if self._text() != self._known:
            allowed = (
                "another program has changed the file: open it again, in the window or on the command line but not "
                "in both"
            )
            raise InvalidInput(ITEM, str(self.path), allowed)
        plain = [test.model_dump(mode="json", exclude_defaults=True) for test in tests]
        content = {"format": FORMAT, "format_version": VERSION, "tests": plain}
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        beside = self.path.with_name(f"{self.path.name}.{os.getpid()}.new")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            try:
                with beside.open("w", encoding="utf-8", newline="\n") as file:
                    file.write(text)
                    file.flush()
                    os.fsync(file.fileno())
                replace(beside, self.path)
            finally:
                beside.unlink(missing_ok=True)
        except OSError as error:
            raise InvalidInput(ITEM, str(self.path), f"the file cannot be written: {error.strerror}") from None
        self._known = text

    def _text(self) -> str | None:
        try:
            return read_bounded(self.path).decode().replace("\r\n", "\n")
        except FileNotFoundError:
            return None
        except UnicodeDecodeError:
            raise InvalidInput(
                ITEM, str(self.path), "it is not UTF-8 text: save it as UTF-8, or choose another file"
            ) from None
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else str(error)
            raise InvalidInput(
                ITEM, str(self.path), f"the file cannot be read ({why}); check its permissions, or choose another file"
            ) from None


class Owner:
    """Ownership of the queue in `path` until `release`; `who` is the owner's name as shown by other programs. The lock
    is on a separate, permanent file, because the queue file is replaced at each change. Raises InvalidInput naming the
    current owner, or the reason why the queue cannot be locked.
    """

    def __init__(self, path: Path, who: str) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._lock = ProcessLock(path, f"{who} (process {os.getpid()})")
        except LockHeld as error:
            raise InvalidInput(ITEM, str(path), f"it is in use by {error.holder}: {REMEDY}") from None
        except OSError as error:
            reason = f"{path}.lock cannot be locked: {error.strerror or error}; choose another folder"
            raise InvalidInput(ITEM, str(path), reason) from None

    def release(self) -> None:
        """Release the lock; may be called repeatedly."""
        self._lock.release()


@contextmanager
def owned(path: Path, who: str) -> Generator[None, None, None]:
    """Context manager that owns the queue in `path`. Raises InvalidInput as `Owner` does."""
    owner = Owner(path, who)
    try:
        yield
    finally:
        owner.release()
