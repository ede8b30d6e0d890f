"""A file with bytes that are not its own: every command says so or reads on, none raises, hangs or changes it.

What hangs is ended by the time limit of every test.
"""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import bench.datafile
from bench.app.cli.main import main
from bench.datafile.declared import TABLES
from bench.datafile.reader import DataFile
from bench.events import PointFinished, State, StateChanged
from sim.errors import RockbenchError
from tests.bench.datafile.example import RATE, Small, begin, block

LONG = (pytest.mark.soak, pytest.mark.timeout(1200))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """A small file as it was closed, and as its writer left it before."""
    path = tmp_path_factory.mktemp("whole") / "campaign.h5"
    recorder = begin(path, point_type=Small)
    recorder(StateChanged(State.ARMED, State.RUNNING, "started", time=0.0))
    for k in range(20):
        recorder(block(100 * k, 100, time=100 * (k + 1) / RATE))
    recorder(PointFinished(Small(number=1, alpha_2=0.5), time=1.0))
    recorder.sync()
    left = path.read_bytes()
    recorder.close("completed", "all done")
    return path.read_bytes(), left


def spoilt(content: bytes, rng: np.random.Generator) -> bytes:
    """A few bytes, a sector or one bit is another, mostly where the file is not empty."""
    data = np.frombuffer(content, np.uint8).copy()
    used = np.flatnonzero(data)
    at = int(rng.choice(used)) if rng.random() < 0.8 else int(rng.integers(len(data)))
    kind, length = rng.integers(3), int(rng.choice([1, 8, 64, 512]))
    if kind == 0:
        data[at] ^= 1 << int(rng.integers(8))
    else:
        data[at : at + length] = rng.integers(256, size=len(data[at : at + length])) if kind == 1 else 0
    return data.tobytes()


def read_all(record: DataFile) -> None:
    """What a report or an export asks for."""
    _ = record.status, record.summary, record.title, record.start_time, record.end_time, record.software
    _ = record.metadata, record.events, record.points, record.results, [record.growing(path) for path in TABLES]
    _ = record.alignments, record.fits, record.identified, record.tables, record.recoveries, record.blocks
    for run in record.runs:
        for series in (*run.channels.values(), run.drive, run.time):
            series[:]
    record.refresh()
    str(record.integrity(None))


def hold(folder: Path, content: bytes, seed: int) -> tuple[int, ...]:
    """Put every command to a spoilt file; returns their exit codes."""
    path, clean = folder / f"{seed}.h5", folder / f"{seed} clean.h5"
    path.write_bytes(spoilt(content, np.random.default_rng(seed)))
    before, codes = path.read_bytes(), list[int]()
    for words in (["info"], ["verify"], ["recover", "--out", str(clean)]):
        codes.append(main(["file", words[0], str(path), *words[1:]]))
        assert path.read_bytes() == before
    assert set(codes) <= {0, 2}
    assert clean.exists() == (codes[-1] == 0)
    with suppress(RockbenchError), bench.datafile.open(path) as record:
        read_all(record)
    if clean.exists():
        with bench.datafile.open(clean) as record:
            read_all(record)
    assert path.read_bytes() == before
    return tuple(codes)


@pytest.mark.parametrize("seeds", [range(1), *(pytest.param(range(k, k + 40), marks=LONG) for k in range(1, 201, 40))])
@pytest.mark.parametrize("closed", [True, False], ids=["closed", "left"])
def test_bytes_that_are_not_its_own(
    files: tuple[bytes, bytes], closed: bool, seeds: range, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = files[0 if closed else 1]
    found = [hold(tmp_path, content, seed) for seed in seeds]
    assert "Traceback" not in capsys.readouterr().err
    if closed:
        # nothing that carries meaning is without a checksum
        assert sum(codes[1] == 2 for codes in found) > len(found) / 3
