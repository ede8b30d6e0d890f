"""The window with the short experiment of the link's tests: `python -m tests.gui.lone_window`."""

from bench.gui.app import open_window
from tests.gui.conftest import SHAKING
from tests.link.experiment import bench

if __name__ == "__main__":
    raise SystemExit(open_window(bench(), (SHAKING,), None, None))
