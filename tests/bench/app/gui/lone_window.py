"""The window with the short experiment of the link's tests: `python -m tests.bench.app.gui.lone_window`."""

from bench.app.gui.window import open_window
from tests.bench.app.gui.conftest import SHAKING
from tests.bench.app.ipc.experiment import bench

if __name__ == "__main__":
    raise SystemExit(open_window(bench(), (SHAKING,), None, None))
