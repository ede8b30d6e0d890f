"""Loaded once by the server that forks the workers: imports, and the compiled bench."""

import gc
import os

# it tells on standard error of every server that goes, as many do here
os.environ.setdefault("GRPC_VERBOSITY", "ERROR")

import nidaqmx._grpc_interpreter  # noqa: F401  # pyright: ignore[reportUnusedImport]

import tests.faults.emulated.pool  # noqa: F401  # pyright: ignore[reportUnusedImport]
from drivers.emulation.optoncdt import laser
from sim.virtual_bench import VirtualBench
from tests.faults.setup import BARE, PARAMETERS

# the machine's time is for many laboratories at once
laser._TURN = 0.01  # pyright: ignore[reportPrivateUsage]
VirtualBench(PARAMETERS, BARE, 1).coast(0.01)

# what has been loaded stays: the collector of a worker need not look at it, and the memory stays shared
gc.collect()
gc.freeze()
gc.set_threshold(2_000, 10, 10)
