"""The window with the short experiment of the link's tests: `python -m tests.bench.app.gui.lone_window`."""

from bench.app.gui.window import open_window
from tests.bench.app.ipc.experiment import SHAKING, bench

if __name__ == "__main__":
    raise SystemExit(open_window(bench(), (SHAKING,), None, None))
