"""Optional dependencies: the extras of the installation, and a check that an extra is installed."""

from importlib.util import find_spec

from sim.errors import InvalidInput, RockbenchError

EXTRAS = {
    "gui": ("PySide6", "pyqtgraph"),
    "ni": ("nidaqmx", "grpc"),
    "serial": ("serial",),
    "export": ("pyarrow", "pyuff"),
    "pdf": ("typst",),
    "distributed": ("distributed",),
}
"""Imported packages of each extra in `pyproject.toml`."""


class MissingExtra(InvalidInput):
    """Error: an extra that the request needs is not installed; nothing was started.

    `item` is the feature that needs it, `value` the name of the extra, `allowed` the commands that install it.
    """

    error_code = "missing_extra"

    def __init__(self, purpose: str, extra: str, package: str) -> None:
        remedy = f'pip install "rocking-bench[{extra}]" (in a checkout: uv sync --inexact --extra {extra})'
        RockbenchError.__init__(self, f"{purpose} needs {package}: {remedy}")
        self.item = purpose
        self.value = extra
        self.allowed = remedy


def require(extra: str, purpose: str, *packages: str) -> None:
    """Check that an extra is installed, before anything starts and without importing it.

    `purpose` is the subject of the error message: the feature that needs the extra. Checks all packages of the extra,
    or only those named. Raises MissingExtra.
    """
    for package in packages or EXTRAS[extra]:
        if not _installed(package):
            raise MissingExtra(purpose, extra, package)


def _installed(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ImportError:
        return False
