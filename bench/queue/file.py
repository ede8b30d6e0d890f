"""The file of a queue: JSON, written anew as a whole after each change."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

from bench.config.validation import dotted, validated
from bench.queue.queued import Queued, Stage
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

ITEM = "queue file"
FORMAT, VERSION = "rocking-bench queue", 1
LEFT = "left while it ran: its folder says how it ended"


class _Tests(Parameters):
    tests: tuple[Queued, ...] = quantity((), "", "the tests, in their order")


class QueueFile:
    """Reads and writes one file, and notices when somebody else has written it in between."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._known: str | None = None

    def read(self) -> tuple[Queued, ...]:
        """The tests of the file; none where there is no file yet. A test that was left while it ran has failed.

        Raises InvalidInput naming file and key.
        """
        text = self._text()
        if text is None:
            self._known = None
            return ()
        try:
            content: Any = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InvalidInput(ITEM, str(self.path), f"it is not JSON: {error}") from None
        data = cast(dict[str, Any], content) if isinstance(content, dict) else {}
        if data.get("format") != FORMAT or data.get("format_version") != VERSION:
            raise InvalidInput(ITEM, str(self.path), f'it must have "format": "{FORMAT}", "format_version": {VERSION}')
        rest = {key: value for key, value in data.items() if key not in ("format", "format_version")}
        tests = validated(_Tests, rest, lambda where: f"{self.path.name}: {dotted(where)}").tests
        self._known = text
        left = {"stage": Stage.FAILED, "told": LEFT}
        return tuple(test.model_copy(update=left) if test.stage is Stage.RUNNING else test for test in tests)

    def write(self, tests: Sequence[Queued]) -> None:
        """Replace the file at once, by one that is whole. Raises InvalidInput when that cannot be done."""
        if self._text() != self._known:
            allowed = "somebody else has changed it: open it again, by the window or the command line but not by both"
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
                beside.replace(self.path)
            finally:
                beside.unlink(missing_ok=True)
        except OSError as error:
            raise InvalidInput(ITEM, str(self.path), f"it cannot be written: {error.strerror}") from None
        self._known = text

    def _text(self) -> str | None:
        try:
            return self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            why = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
            raise InvalidInput(ITEM, str(self.path), f"it cannot be read: {why}") from None
