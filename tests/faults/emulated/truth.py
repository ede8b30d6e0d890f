"""What must be true of the emulated laboratory, whatever went wrong: at every tick, and at the end."""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tests.faults.audit import RAMPED, unrest
from tests.faults.bench import Story
from tests.faults.emulated.bench import WiredBench
from tests.faults.emulated.fault import WiredFault
from tests.faults.emulated.setup import KEEPER, SETTING
from tests.faults.emulated.witness import Truth, Witness

GRACE = 0.5
"""What the relay may open later than its time-out after the last call [s]: the machine may be busy."""
OUTPUT = "Dev1/ao0"


def end_rules(bench: WiredBench, fault: WiredFault) -> Iterator[str]:
    """The driver is closed: relay open and output stage at zero, or the relay soon when nobody reaches the device."""
    laboratory = bench.laboratory
    if fault.unreachable:
        deadline = time.monotonic() + KEEPER + GRACE
        while laboratory.bench.enabled and time.monotonic() < deadline:
            time.sleep(0.005)
    if laboratory.bench.enabled:
        yield "the relay is closed at the end"
    if not fault.unreachable and (held := laboratory.daq.volts(OUTPUT)) != 0.0:
        yield f"the output stage holds {held:.3g} V at the end"
    # two turns of the bench, so that the end has been witnessed
    time.sleep(0.05)
    truth = bench.witness.told()
    if truth.amplifier[-1] != 0.0:
        yield f"the amplifier hears {truth.amplifier[-1]:.3g} V at the end"


def motion_rules(truth: Truth, story: Story) -> Iterator[str]:
    """Drive and table at every tick."""
    limits = SETTING.limits
    peaks = {
        "V": (truth.output, limits.drive_voltage),
        "m": (truth.x, limits.displacement),
        "m/s": (truth.v, limits.velocity),
        "m/s2": (truth.a, limits.acceleration),
    }
    for unit, (values, limit) in peaks.items():
        # written so that a value that is none breaks it
        if not np.abs(values).max() <= limit:
            yield f"{np.abs(values).max():.3g} {unit} where {limit:g} is allowed"
    step = np.diff(truth.amplifier) * SETTING.rate
    if story.status not in RAMPED:
        # the relay opens, or the output is put to zero at once
        step = step[truth.amplifier[1:] != 0.0]
    if (fastest := np.abs(step).max(initial=0.0)) > limits.drive_slew * (1.0 + 1e-9):
        yield f"the drive changed by {fastest:.3g} V/s"


def played_rules(bench: WiredBench, truth: Truth) -> Iterator[str]:
    """What the program believes to have played is what left the output stage, sample by sample."""
    for number, start in bench.wired.starts.items():
        run = bench.rig.runs[number]
        left = _left(truth, start, run.read)
        wrong = np.flatnonzero(left != run.drive[: run.read])
        # a cut may come in the middle of the block that is read
        if wrong.size and left[wrong[0] :].any():
            yield f"run {number + 1} played something else from sample {wrong[0]} on"


def _left(truth: Truth, start: int, n: int) -> NDArray[np.float64]:
    return truth.output[start - truth.first : start - truth.first + n]


def rest_rules(witness: Witness) -> Iterator[str]:
    """The laboratory is closed: what the table does after it."""
    yield from unrest(witness.virtual)
