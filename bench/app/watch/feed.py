"""Latest state of the live page, serialised once for all browsers; a browser receives the changed parts only."""

import json
import threading
from collections.abc import Mapping

from drivers.clock import now

WANTED = 2.0
"""Time for which the document is kept up to date after a browser last requested it [s]."""


class Feed:
    """Parts of a document as JSON texts, each with the version of the document in which it last changed."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._parts: dict[str, tuple[int, bytes]] = {}
        self._version = self._publications = 0
        self._read = -WANTED
        self.closed = False

    @property
    def has_readers(self) -> bool:
        """Whether a browser has recently waited for the document."""
        return now() - self._read < WANTED

    def publish(self, document: Mapping[str, object]) -> None:
        """Replace the changed parts of the document. Raises ValueError for a number that JSON cannot represent."""
        parts = {
            name: json.dumps(part, separators=(",", ":"), allow_nan=False).encode() for name, part in document.items()
        }
        with self._changed:
            changed = {
                name: text for name, text in parts.items() if name not in self._parts or self._parts[name][1] != text
            }
            if changed:
                self._version += 1
                self._parts.update({name: (self._version, text) for name, text in changed.items()})
            self._publications += 1
            self._changed.notify_all()

    def since(self, version: int, timeout: float) -> tuple[int, bytes]:
        """The current version, and the parts that changed after `version` (0 for all) as a JSON object. Waits up to
        `timeout` [s] for a change; without one, the object is empty.
        """
        with self._changed:
            stale, known = not self.has_readers, self._publications
            self._read = now()
            if stale:
                # without readers the document is not kept up to date: wait for the next one
                self._changed.wait_for(lambda: self._publications > known or self.closed, timeout)
            self._changed.wait_for(lambda: self._version > version or self.closed, timeout)
            found = [(name, text) for name, (number, text) in self._parts.items() if number > version]
            return self._version, b"{%b}" % b",".join(b'"%b":%b' % (name.encode(), text) for name, text in found)

    def close(self) -> None:
        """Close the feed, and end all waits for changes."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()
