"""Cache of results computed from the model, reused by later runs with the same inputs.

The name of an entry contains a hash of its inputs, of all source files of this program, and of the versions of the
libraries and the processor type, which affect the last digits. Entries are JSON files, which preserve all digits and
cannot execute code, in a subfolder of the compiled kernel's folder, to which only this user can write. A result whose
entry cannot be read is computed again; a failure to write an entry is ignored.
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
"""Environment variable that disables the cache if its value is "off"."""

FOLDER = "results"
MOST = 4000
"""Maximum number of entries; if it is exceeded, the least recently used ones are removed until half that number remain.
"""

PACKAGES = ("bench", "drivers", "protocols", "sim")


def cached(kind: str, inputs: object, compute: Callable[[], Any]) -> Any:
    """Return the result of `compute()`, from the cache if the cache has an entry for `inputs`.

    Both `inputs` and the result must be JSON-serialisable. `kind` names the computation.
    """
    folder = _folder()
    if folder is None:
        return compute()
    text = json.dumps([kind, inputs, stamp()], sort_keys=True)
    path = folder / f"{kind}-{sha256(text.encode()).hexdigest()}.json"
    with suppress(OSError, ValueError, KeyError, TypeError):
        stored = json.loads(path.read_text(encoding="utf-8"))
        # compare the inputs as well, because different inputs might have the same hash
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
    """Hash of the source files, versions and processor on which a result depends in addition to its inputs."""
    from sim.kernel.compiled import processor

    root, digest = Path(__file__).parents[1], sha256()
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    return [digest.hexdigest(), software(), platform.machine(), processor()]
