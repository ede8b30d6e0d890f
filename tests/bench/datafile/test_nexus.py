"""The file as NeXus programs see it, with plain h5py: classes, units, and the plot they draw unasked."""

from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench.events import PointFinished, Warned
from tests.bench.datafile.example import CHANNELS, FULL, METADATA, begin, block, record

CLASSES = {"NXroot", "NXentry", "NXinstrument", "NXsensor", "NXdata", "NXcollection", "NXuser", "NXnote"}


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("nexus") / "campaign.h5"
    recorder = begin(path, metadata=METADATA | {"operator": "A. Muster", "notes": "a note"})
    record(recorder, block(0, 3000, time=1.5), PointFinished(FULL, time=5.0), Warned("text", time=6.0))
    return path


def default_plot(file: Any) -> Any:
    """The group to be plotted, by the rule of NIAC 2014: follow `default` down from the root to NXdata."""
    group = file
    while group.attrs["NX_class"] != "NXdata":
        group = group[group.attrs["default"]]
    return group


def test_groups_have_classes_and_numbers_have_units(path: Path) -> None:
    found: list[tuple[str, Any]] = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.append((name, item)))
        for name, item in found:
            if isinstance(item, h5py.Group):
                assert item.attrs["NX_class"] in CLASSES, name
            elif item.dtype.kind in "iuf":
                assert item.attrs["units"], name
        entry: Any = file["entry"]
        assert entry["user/name"][()] == b"A. Muster"
        assert entry["notes/data"][()] == b"a note"


def test_the_default_plot_has_a_signal_an_axis_and_the_way_to_values(path: Path) -> None:
    with h5py.File(path) as file:
        plot = default_plot(file)
        signal, (axis,) = plot[plot.attrs["signal"]], plot.attrs["axes"]
        assert signal.shape == plot[axis].shape == (3000,)
        assert plot.attrs[f"{axis}_indices"] == 0
        assert (signal.attrs["units"], plot[axis].attrs["units"]) == ("counts", "s")
        assert np.all(np.diff(plot[axis][:]) > 0.0)
        assert all(plot[name].shape == signal.shape for name in plot.attrs["auxiliary_signals"])
        for channel in CHANNELS:
            # NXdata: corrected values = (FIELDNAME + offset) * scaling_factor
            factor, offset = plot[f"{channel.name}_scaling_factor"], plot[f"{channel.name}_offset"]
            counts = plot[channel.name][:]
            inside = (counts >= channel.valid[0]) & (counts <= channel.valid[1])
            expected = channel.to_unit(counts)[inside]
            np.testing.assert_allclose((counts[inside] + offset[()]) * factor[()], expected, rtol=1e-12, atol=1e-15)
            assert factor.attrs["units"] == channel.unit


def test_only_filters_of_every_library_are_used(path: Path) -> None:
    filters: set[str] = set()

    def note(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            plist = item.id.get_create_plist()
            filters.update(plist.get_filter(k)[3].decode() for k in range(plist.get_nfilters()))

    with h5py.File(path) as file:
        file.visititems(note)
    assert filters == {"shuffle", "deflate"}
