"""What software made a result."""

import platform
from importlib.metadata import PackageNotFoundError, version


def software() -> dict[str, str]:
    """Versions of this program, of Python and of the libraries that numbers depend on."""
    found = {"rocking-bench": _version("rocking-bench"), "python": platform.python_version()}
    return found | {name: _version(name) for name in ("numpy", "scipy", "numba", "h5py")}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
