"""Files of results that later runs load: JSON with a head that says what they are, written once."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from bench.provenance import software
from sim.errors import InvalidInput

_HEAD = ("format", "format_version", "software")


@dataclass(frozen=True)
class KeptFile:
    """One kind of them: `item` names it in errors, `remedy` says where one comes from."""

    item: str
    format: str
    version: int
    remedy: str

    def write(self, path: Path, content: Mapping[str, Any]) -> None:
        """Write a new file, SI units. Raises InvalidInput when `path` exists or cannot be written."""
        head = dict(zip(_HEAD, (self.format, self.version, software()["rocking-bench"]), strict=True))
        text = json.dumps({**head, **content}, indent=1, ensure_ascii=False, allow_nan=False)
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(text + "\n")
        except FileExistsError:
            raise InvalidInput(self.item, str(path), "it exists already; it is never overwritten") from None
        except OSError as error:
            raise InvalidInput(self.item, str(path), f"it cannot be written: {error.strerror}") from None

    def read(self, path: Path) -> dict[str, Any]:
        """What a file holds, without its head. Raises InvalidInput for one of another kind or version."""
        try:
            data: Any = json.loads(path.read_text(encoding="utf-8-sig"))
        except FileNotFoundError:
            raise InvalidInput(self.item, str(path), "there is no such file") from None
        except OSError as error:
            raise InvalidInput(self.item, str(path), f"it cannot be read: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise InvalidInput(self.item, str(path), f"it is not JSON: {error}") from None
        content = cast(dict[str, Any], data) if isinstance(data, dict) else {}
        if content.get("format") != self.format:
            allowed = f'it is no {self.item}: its "format" is not "{self.format}"; {self.remedy}'
            raise InvalidInput(self.item, str(path), allowed)
        if (said := content.get("format_version")) != self.version:
            allowed = f"this program reads format version {self.version}, the file says {said!r}: use a newer program"
            raise InvalidInput(self.item, str(path), allowed)
        return {key: value for key, value in content.items() if key not in _HEAD}
