"""Raw values of sensors with their own clocks: recorded, read, recovered, and resampled again."""

from dataclasses import replace
from pathlib import Path

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench.datafile.hdf5 import PAGE
from bench.datafile.reader import open_datafile
from bench.datafile.recovery import recover
from bench.events import Acquired, Event, SensorsAligned, ValuesReceived
from drivers.optoncdt.codec import LATE, MEANINGS, MID_RANGE, count_size
from drivers.rig import Alignment, Block, Channel, RawValues
from sim.errors import InvalidInput
from tests.bench.datafile.example import RATE, begin, record

LASER = Channel(
    "laser_1", "displacement", "m", count_size(0.2), 0.0, (-MID_RANGE, MID_RANGE), "a sensor", faults=MEANINGS
)
PERIOD = 250
"""Period of the sensor's measurements on its own clock [us]."""
OFFSET, SLOPE, DELAY = -3.2, 1.0 + 40e-6, 1.5e-3


def motion(seconds: np.ndarray) -> np.ndarray:
    """Displacement at seconds of the sample clock [m]."""
    return 0.02 * np.sin(2.0 * np.pi * 1.3 * seconds)


def values(first: int, n: int) -> RawValues:
    """`n` measurements from number `first` on, as the sensor sends them; every hundredth is lost."""
    index = np.array([k for k in range(first, first + n) if k % 100])
    time = PERIOD * index
    seconds = OFFSET + SLOPE * 1e-6 * time + DELAY
    code = np.rint(motion(seconds) / count_size(0.2)).astype(np.int64) + MID_RANGE
    return RawValues("laser_1", index, time, code, time + 400)


def stream(blocks: int) -> list[Event]:
    """Blocks of 100 samples in which every sample of the laser was late, and the values that it sent."""
    events: list[Event] = []
    each = round(100 / RATE / (1e-6 * PERIOD))
    begun = round(3.0e6 / PERIOD)
    for k in range(blocks):
        counts = np.full((100, 1), LATE, dtype=np.int16)
        events.append(Acquired(1, Block(100 * k, counts), np.zeros(100), time=0.05 * k))
        events.append(ValuesReceived(1, (values(begun + each * k, each),)))
    # those of the last block came after it
    events.append(ValuesReceived(1, (values(begun + each * blocks, 4 * each),)))
    events.append(SensorsAligned(1, (Alignment("laser_1", OFFSET, SLOPE, 1e-6, DELAY, 1, 0),)))
    return events


def test_every_value_is_in_the_file_and_samples_that_were_late_are_found_again(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    events = stream(40)
    record(begin(path, channels=[LASER]), *events)
    sent = [event.raw[0] for event in events if isinstance(event, ValuesReceived)]
    with open_datafile(path) as kept:
        raw = kept.raw_values("laser_1", 1)
        for name in ("index", "time", "code", "arrival"):
            np.testing.assert_array_equal(getattr(raw, name), np.concatenate([getattr(one, name) for one in sent]))
        assert np.isnan(kept.values("laser_1")).all()
        again = kept.resampled("laser_1", 1)
        seconds = np.arange(again.size) / RATE
        known = np.isfinite(again)
        # around each lost measurement a sample or two have no value
        assert known.mean() > 0.97
        # half a word, and the chord of the motion between two words
        np.testing.assert_allclose(again[known], motion(seconds[known]), atol=count_size(0.2))
        assert not len(kept.raw_values("laser_1", 2))
        with pytest.raises(InvalidInput, match=r"laser_1.*run 2.*channels with them: laser_1"):
            kept.resampled("laser_1", 2)
        assert not kept.integrity(None).failing


def test_complete_chunks_leave_no_remainder_of_a_page(tmp_path: Path) -> None:
    """HDF5 describes every remainder in memory until the file is closed."""
    path = tmp_path / "campaign.h5"
    record(begin(path, channels=[LASER]), *stream(200))
    with h5py.File(path, "r") as file:
        for name in ("laser_1/counts", "drive/voltage", "raw_values/index", "raw_values/code"):
            stored = file[f"entry/instrument/{name}"]
            whole = len(stored) // stored.chunks[0]
            sizes = [stored.id.get_chunk_info(number).size for number in range(whole)]
            assert whole
            assert all(size % PAGE == 0 or (size < PAGE and size.bit_count() == 1) for size in sizes), (name, sizes)


def test_they_take_less_than_preflight_reserves(tmp_path: Path) -> None:
    from bench.app.preflight import RAW_BYTES

    rng = np.random.default_rng(1)
    index = np.arange(200_000)
    # a moving target with noise: the low byte of the words does not compress
    code = MID_RANGE + np.rint(8000 * np.sin(index / 900.0) + rng.normal(0.0, 3.0, index.size)).astype(np.int64)
    time = 10 * np.floor(25.0 * (1 + 30e-6) * index).astype(np.int64)
    arrival = np.repeat(np.cumsum(rng.integers(2400, 4000, index.size // 10)), 10)
    sizes: list[int] = []
    for name, several in (("with", (RawValues("laser_1", index, time, code, arrival),)), ("without", ())):
        path = tmp_path / f"{name}.h5"
        record(begin(path, channels=[LASER]), ValuesReceived(1, several))
        sizes.append(path.stat().st_size)
    assert (sizes[0] - sizes[1]) / index.size < RAW_BYTES


def test_they_are_recovered(tmp_path: Path) -> None:
    path, target = tmp_path / "campaign.h5", tmp_path / "again.h5"
    record(begin(path, channels=[LASER]), *stream(40))
    assert recover(path, target).loss == ""
    with open_datafile(path) as before, open_datafile(target) as after:
        np.testing.assert_array_equal(before.resampled("laser_1", 1), after.resampled("laser_1", 1))


def test_chunks_kept_in_memory_are_few(tmp_path: Path) -> None:
    """HDF5 keeps so much of each dataset until the file is closed: by default 8 MB of each, a gigabyte in all."""
    recorder = begin(tmp_path / "campaign.h5", channels=[LASER])
    kept = [each._stored.id.get_access_plist().get_chunk_cache()[1] for each in recorder._writer._parts.grown]  # pyright: ignore
    recorder.close("completed")
    assert sum(kept) < 30e6


def test_a_lost_channel_does_not_rename_the_sensors_after_it(tmp_path: Path) -> None:
    path, target = tmp_path / "campaign.h5", tmp_path / "again.h5"
    table = Channel("table_displacement", "displacement", "m", 1e-6, 0.0, (-32000, 32000), "made")
    lasers = [replace(LASER, name=name) for name in ("laser_1", "laser_2")]
    sent = {
        name: RawValues(name, *(np.arange(9) + k for _ in range(4))) for k, name in ((10, "laser_1"), (50, "laser_2"))
    }
    events = [Acquired(1, Block(0, np.zeros((100, 3), dtype=np.int16)), np.zeros(100), time=0.1)]
    record(begin(path, channels=[table, *lasers]), *events, ValuesReceived(1, tuple(sent.values())))
    with h5py.File(path, "r+") as file:
        del file["entry/instrument/table_displacement/counts"].attrs["scale"]
    recover(path, target)
    with open_datafile(target) as kept:
        assert [channel.name for channel in kept.channels] == ["laser_1", "laser_2"]
        for name, raw in sent.items():
            np.testing.assert_array_equal(kept.raw_values(name, 1).index, raw.index)
