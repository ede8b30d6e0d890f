"""The default plot of a file, by the rules of NeXus (NXdata): silx, NexPy, h5web and their like draw it unasked."""

from collections.abc import Sequence

from bench.record import hdf5
from drivers.rig import Channel

GROUP, TIME = "data", "time"


def create_plot(entry: hdf5.Group, channels: Sequence[Channel], chunk: int) -> hdf5.Dataset:
    """The first channel and its like against time, links to all the others beside them; the time axis to be filled.

    Counts stay counts: `<name>_scaling_factor` and `<name>_offset` are the standard's way to values,
    (counts + offset) * scaling_factor.
    """
    data = hdf5.create_group(entry, GROUP, "NXdata")
    first, *others = channels
    data.attrs["signal"], data.attrs["axes"] = first.name, [TIME]
    data.attrs[f"{TIME}_indices"] = 0
    # what is of another kind has another scale, and would flatten the picture
    alike = [channel.name for channel in others if (channel.quantity, channel.unit) == (first.quantity, first.unit)]
    if alike:
        data.attrs["auxiliary_signals"] = alike
    data.attrs["title"] = f"{first.quantity}, counts as converted"
    time = hdf5.grow_numbers(
        data,
        TIME,
        "<f8",
        unit="s",
        description="bench time of each row, for plots; blocks place the rows exactly",
        chunk=chunk,
        compress=True,
    )
    time.attrs["long_name"] = "bench time [s]"
    for channel in channels:
        hdf5.link(data, channel.name, f"/entry/instrument/{channel.name}/counts")
        factor, offset = companions(channel.name)
        hdf5.write_numbers(data, factor, channel.scale, unit=channel.unit, description="value of a count, NXdata")
        hdf5.write_numbers(
            data, offset, channel.offset / channel.scale, unit="counts", description="added to the counts first, NXdata"
        )
    return time


def companions(name: str) -> tuple[str, str]:
    """What stands beside a channel in the plot: the names of its scaling factor and of its offset."""
    return f"{name}_scaling_factor", f"{name}_offset"
