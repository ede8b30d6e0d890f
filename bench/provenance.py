"""Versions of the software that produced a result, determined once in a process: later changes concern code that the
process has not loaded.
"""

import json
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path


def software() -> dict[str, str]:
    """Versions of this program, Python and the libraries on which results depend."""
    found = {"rocking-bench": _version("rocking-bench"), "python": platform.python_version()}
    return found | {name: _version(name) for name in ("numpy", "scipy", "numba", "h5py")}


@cache
def revision() -> str:
    """Git hash of this program, followed by "+" if there are uncommitted changes. Outside a repository it is the hash
    from which the program was installed, or "unknown".
    """
    here = Path(__file__).parent
    try:
        found = subprocess.run(
            ["git", "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty=+"],
            cwd=here,
            capture_output=True,
            text=True,
            timeout=10.0,
            check=True,
        )
        # ignore the repository of another project inside which this program is installed
        subprocess.run(["git", "ls-files", "--error-unmatch", __file__], cwd=here, capture_output=True, check=True)
        return found.stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return _installed_revision()


def _installed_revision() -> str:
    """Hash recorded by the installer when it installed the program from a repository."""
    try:
        noted = json.loads(distribution("rocking-bench").read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, OSError, json.JSONDecodeError):
        return "unknown"
    return str(noted.get("vcs_info", {}).get("commit_id", "unknown"))


@cache
def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
