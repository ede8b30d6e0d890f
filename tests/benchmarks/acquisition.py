"""Sustained acquisition over the emulated wire: nothing lost, and what it costs the client.

    python -m tests.benchmarks.acquisition [--minutes 10]

The emulated laboratory runs in a process of its own; this process is the client: the real nidaqmx over gRPC and the
real pyserial, 4 analogue inputs at 20 000 samples/s each and two lasers at 4 kHz with counter and time stamp.
"""

import argparse
import sys
import time

import numpy as np

from drivers.hardware.parameters import CoilCurrent, TableForce
from drivers.hardware.rig import HardwareRig
from tests.emulated import emulated

SAMPLE_RATE = 20_000.0
BLOCK = 2_000
LEAD = 8_000


def measure(minutes: float) -> bool:
    """Read for `minutes`, print what was seen, and say whether the requirements are met."""
    with emulated("--sample-rate", str(SAMPLE_RATE)) as configuration:
        # two more inputs on the terminals that the serial lasers leave free
        wired = {"table_force": TableForce(terminal="Dev1/ai2"), "coil_current": CoilCurrent(terminal="Dev1/ai3")}
        with HardwareRig(configuration.hardware.model_copy(update=wired), lead=LEAD) as rig:
            names = [channel.name for channel in rig.channels]
            lasers = [names.index(name) for name in ("laser_1", "laser_2")]
            valid = [rig.channels[column].valid for column in lasers]
            rig.arm()
            rig.write(np.zeros(LEAD))
            blocks = round(60.0 * minutes * SAMPLE_RATE / BLOCK)
            waits, lost, contiguous = np.empty(blocks), 0, True
            cpu, begin = time.process_time(), time.monotonic()
            for number in range(blocks):
                rig.write(np.zeros(BLOCK))
                block = rig.read(BLOCK)
                waits[number] = time.monotonic() - begin - (number + 1) * BLOCK / SAMPLE_RATE
                contiguous &= block.first == number * BLOCK and len(block) == BLOCK
                for column, (low, high) in zip(lasers, valid, strict=True):
                    counts = block.counts[:, column]
                    lost += int(np.count_nonzero((counts < low) | (counts > high)))
            cpu, elapsed = time.process_time() - cpu, time.monotonic() - begin
            rig.stop()
            alignments = rig.alignments
    late = 1e3 * (waits - waits.min())
    print(f"channels           {len(names)} at {SAMPLE_RATE:g} samples/s: {', '.join(names)}")
    print(f"duration           {elapsed:.1f} s, {blocks} blocks of {BLOCK}")
    print(f"blocks contiguous  {contiguous}")
    print(f"laser samples invalid {lost} of {2 * blocks * BLOCK}")
    for one in alignments:
        ppm = 1e6 * (one.rate - 1.0)
        print(
            f"{one.sensor}: {one.values} values, {one.lost} lost; rate {ppm:+.2f} ppm,"
            f" residual {1e6 * one.residual:.1f} us"
        )
    print(f"block later than the earliest by: median {np.median(late):.2f} ms, 99 % {np.percentile(late, 99):.2f} ms,"
          f" worst {late.max():.2f} ms")  # fmt: skip
    share = cpu / elapsed
    print(f"CPU of the client  {share:.3f} of a core")
    good = contiguous and lost == 0 and share < 0.5 and not any(one.lost for one in alignments)
    print("requirement        " + ("met" if good else "NOT MET") + ": no lost sample, CPU below 0.5 of a core")
    return good


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--minutes", type=float, default=10.0)
    sys.exit(0 if measure(parser.parse_args().minutes) else 1)
