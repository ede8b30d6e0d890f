"""A writer that is killed at any moment: nothing that was told to be written is lost, and a clean file comes of it."""

import os
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from bench.datafile.recovery import recover
from bench.datafile.writer import journal_path, read_journal
from tests.bench.datafile.living import (
    RATE,
    as_fast_as_it_can,
    at_its_pace,
    check,
    killed,
)

pytestmark = pytest.mark.skipif(os.name != "posix", reason="forks and kills the POSIX way")
LONG = (pytest.mark.soak, pytest.mark.timeout(1200))


@pytest.mark.parametrize("kills", [3, *(pytest.param(16, marks=LONG, id=f"soak {k}") for k in range(4))])
def test_every_kill_leaves_what_was_told_and_a_clean_file_comes_of_it(tmp_path: Path, kills: int) -> None:
    # the moment is random by itself: the writer is another process
    rng, seen = np.random.default_rng(), set[int]()
    for number in range(4 * kills):
        if number >= kills and len(seen) > 2:
            break
        path, clean = tmp_path / f"{number}.h5", tmp_path / f"clean {number}.h5"
        # on a slow computer later too, until the moments differ
        latest = 0.15 * (1 + number // kills)
        rows, points = killed(path, as_fast_as_it_can, float(rng.uniform(0.0, latest)))
        before = path.read_bytes()
        with open_datafile(path) as record:
            assert record.status == "running"
            check(record, rows, points)
            kept = record.rows
        recover(path, clean)
        assert path.read_bytes() == before
        path.unlink()
        assert number % 8 or verify(clean).problems == ()
        with open_datafile(clean) as record:
            assert (record.status, record.rows) == ("interrupted", kept)
            check(record, rows, points)
            assert len(record.events) == len(list(read_journal(journal_path(path))))
            assert len(record.points) == sum("point" in line for line in read_journal(journal_path(path)))
        seen.add(rows)
    # at different moments, however busy the machine is
    assert len(seen) > 2


def test_at_most_the_last_second_is_lost_at_real_time(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    rows, _ = killed(path, at_its_pace, 2.3)
    recover(path, tmp_path / "clean.h5")
    with open_datafile(tmp_path / "clean.h5") as record:
        assert rows > 2.0 * RATE
        check(record, rows - int(RATE), 0)
