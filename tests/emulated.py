"""An emulated laboratory in a process of its own, as an operator starts it."""

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.config.toml import read_configuration
from tests.patience import LONG


@contextmanager
def emulated(*arguments: str, shown: bool = False) -> Iterator[BenchConfiguration]:
    """`rockbench emulate` with these arguments, and the configuration that it hands out; `shown` passes on its notes,
    among them that of its own lateness."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "emulated.toml"
        command = [sys.executable, "-m", "bench", "emulate", "--write", str(file), "--lead", "0.4", *arguments]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=None if shown else subprocess.DEVNULL)
        try:
            deadline = time.monotonic() + LONG
            while not file.exists() or not file.stat().st_size:
                if process.poll() is not None or time.monotonic() > deadline:
                    raise RuntimeError(f"no emulated laboratory: its process says {process.poll()}")
                time.sleep(0.05)
            yield read_configuration(file)
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(LONG)
