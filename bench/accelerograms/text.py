"""Text of a record file as numbered lines, with any kind of line ending."""

import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from bench.bounded import read_bounded
from sim.errors import InvalidInput

_CONTROL_Z = "\x1a"
"""DOS padding at the end of a text file."""


@dataclass(frozen=True)
class RecordText:
    """Lines of a file, stripped of their endings (LF, CR LF, CR CR LF, CR), and the hash of the file's bytes."""

    path: Path
    lines: tuple[str, ...]
    sha256: str

    def where(self, index: int) -> str:
        """Description of the line `index`, counted from 0, for an error message."""
        return f"{self.path.name}, line {index + 1}"

    def refusal(self, index: int, allowed: str) -> InvalidInput:
        """The error for a line; its message quotes the line."""
        shown = self.lines[index].strip() if index < len(self.lines) else ""
        return InvalidInput(self.where(index), shown if len(shown) <= 60 else shown[:57] + "...", allowed)


def load(path: Path) -> RecordText:
    """Read a file. Raises InvalidInput if it cannot be read, is too large or empty, or is not text."""
    try:
        content = read_bounded(path)
    except FileNotFoundError:
        raise InvalidInput("record", str(path), "there is no such file") from None
    except OSError as error:
        raise InvalidInput(
            "record", str(path), f"the file cannot be read ({error.strerror}); check its path and permissions"
        ) from None
    except ValueError as error:
        raise InvalidInput("record", str(path), str(error)) from None
    if b"\0" in content:
        raise InvalidInput("record", str(path), "it is not a text file with one byte per character; export it as text")
    # headers contain place names in any encoding, numbers are ASCII: Latin-1 decodes every byte
    text = content.removeprefix(b"\xef\xbb\xbf").decode("latin-1").rstrip(_CONTROL_Z + " \t\r\n")
    if not text:
        raise InvalidInput("record", str(path), "the file is empty")
    return RecordText(path, tuple(re.split(r"\r*\n|\r", text)), sha256(content).hexdigest())
