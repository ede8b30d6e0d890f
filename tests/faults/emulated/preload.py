"""Loaded once by the server that forks the workers: imports, and the compiled bench."""

import os

# it tells on standard error of every server that goes, as many do here
os.environ.setdefault("GRPC_VERBOSITY", "ERROR")

import tests.faults.emulated.judge  # noqa: F401
from drivers.emulation.optoncdt import laser
from sim.virtual_bench import VirtualBench
from tests.faults.setup import BARE, PARAMETERS

# the machine's time is for many laboratories at once
laser._TURN = 0.01  # pyright: ignore[reportPrivateUsage]
VirtualBench(PARAMETERS, BARE, 1).coast(0.01)
