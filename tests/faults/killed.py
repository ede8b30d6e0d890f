"""Campaigns whose process is killed in the middle of a state: `python -m tests.faults.killed FOLDER PLACE ...`.

Each runs in a child that kills itself; the file is told apart by the number of its place among those
given. Once the record has been brought to the disk before, and once not.
"""

import os
import signal
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from tests.faults.bench import FaultyBench, run
from tests.faults.places import PLACES


def _die(bench: FaultyBench, *, flushed: bool) -> None:
    assert bench.recorder is not None
    if flushed:
        bench.recorder.sync()
    os.kill(os.getpid(), signal.SIGKILL)


def main(folder: Path, names: Sequence[str]) -> None:
    """Kill one child in each place of these names, with and without a flush before."""
    places = [place for name in names for place in PLACES if place.name == name]
    # what is compiled and imported now, no child has to
    run(FaultyBench(None))
    for flushed in (True, False):
        for number, place in enumerate(places):
            path = folder / f"{'flushed' if flushed else 'raw'}-{number}.h5"
            if (child := os.fork()) == 0:
                run(FaultyBench(path, place, partial(_die, flushed=flushed)))
                os._exit(3)
            _, status = os.waitpid(child, 0)
            print(path.name, os.waitstatus_to_exitcode(status), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
