"""Cache of results computed from the model, for later runs with the same inputs.

The name of an entry is a hash of its inputs, of all source files of this program, and of the libraries and processor
that affect the last digits. Entries are stored as JSON, which preserves all digits and executes no code, in the folder
of the compiled kernel, which only this user can write. An unreadable entry is computed again; a failure to write one is
ignored.
"""

import json
import os
import platform
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from bench.provenance import software
from bench.unfinished import replace

SWITCH = "ROCKBENCH_RESULT_CACHE"
"""Environment variable; the value "off" disables the cache."""

FOLDER = "results"
MOST = 4000
"""Maximum number of entries; beyond it, the least recently used ones are removed until half of this number is left."""

PACKAGES = ("bench", "drivers", "protocols", "sim")


def cached(kind: str, inputs: object, compute: Callable[[], Any]) -> Any:
    """Result of `compute` for `inputs`, both JSON content, from the cache if possible; `kind` names the computation."""
    folder = _folder()
    if folder is None:
        return compute()
    text = json.dumps([kind, inputs, stamp()], sort_keys=True)
    path = folder / f"{kind}-{sha256(text.encode()).hexdigest()}.json"
    with suppress(OSError, ValueError, KeyError, TypeError):
        stored = json.loads(path.read_text(encoding="utf-8"))
        # compare the inputs, not only their hash; a truncated file has no result
        if stored["inputs"] == text:
            os.utime(path)
            return stored["result"]
    result = compute()
    with suppress(OSError):
        _write(path, json.dumps({"inputs": text, "result": result}))
    return result


def _folder() -> Path | None:
    """Folder of the entries; None if the cache is off or no private folder exists."""
    if os.environ.get(SWITCH) == "off":
        return None
    from sim.kernel.compiled import cache_folder

    kernel = cache_folder()
    return None if kernel is None else kernel / FOLDER


def _write(path: Path, text: str) -> None:
    """Write an entry atomically: another process may read it at the same time."""
    path.parent.mkdir(mode=0o700, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".new-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        replace(Path(name), path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    _prune(path.parent)


def _prune(folder: Path) -> None:
    entries = list(folder.glob("*.json"))
    if len(entries) <= MOST:
        return
    aged = sorted((entry.stat().st_mtime, entry) for entry in entries)
    for _, entry in aged[: len(entries) - MOST // 2]:
        entry.unlink(missing_ok=True)


@lru_cache(maxsize=1)
def stamp() -> list[object]:
    """All versions and hashes, apart from the inputs, on which a result depends."""
    from sim.kernel.compiled import processor

    root, digest = Path(__file__).parents[1], sha256()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return [digest.hexdigest(), software(), platform.machine(), processor()]
