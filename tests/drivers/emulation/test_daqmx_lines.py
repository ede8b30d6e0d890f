"""Digital inputs of the emulated device, as the real client sees them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from nidaqmx.constants import LineGrouping
from nidaqmx.errors import DaqError
from nidaqmx.stream_readers import DigitalMultiChannelReader

from drivers.emulation.daqmx.lines import Wires
from drivers.emulation.daqmx.models import compact_rio, x_series
from tests.drivers.emulation.daqmx_loopback import Desk

LEVELS = {"Dev1/port0/line1": True, "Dev1/port0/line2": False, "Dev1/port0/line3": True}


@pytest.fixture
def desk() -> Iterator[Desk]:
    shown = {line: lambda line=line: LEVELS[line] for line in LEVELS}
    with Desk(wires=Wires({}, shown)) as desk:
        yield desk


def reading(desk: Desk, lines: str, grouping: LineGrouping = LineGrouping.CHAN_PER_LINE, name: str = "di") -> Any:
    task = desk.task(name)
    task.di_channels.add_di_chan(lines, line_grouping=grouping)
    return task


def test_lines_show_what_is_wired_to_them_and_are_pulled_down_else(desk: Desk) -> None:
    assert reading(desk, "Dev1/port0/line1:4").read() == [True, False, True, False]


def test_lines_of_one_channel_come_together(desk: Desk) -> None:
    task = reading(desk, "Dev1/port0/line1:2", LineGrouping.CHAN_FOR_ALL_LINES)
    task.di_channels.add_di_chan("Dev1/port0/line3")
    data = np.zeros((2, 2), bool)
    DigitalMultiChannelReader(task.in_stream).read_one_sample_multi_line(data)
    # one byte per line, a channel with fewer lines is filled up
    assert data.tolist() == [[True, False], [True, False]]


def test_a_read_starts_a_task_for_itself_only(desk: Desk) -> None:
    task = reading(desk, "Dev1/port0/line1")
    for _ in range(2):
        assert task.read() is True
        assert task.is_task_done()
    task.start()
    assert task.read() is True
    assert not task.is_task_done()


def test_a_line_belongs_to_one_task(desk: Desk) -> None:
    output = desk.task("do")
    output.do_channels.add_do_chan("Dev1/port0/line1")
    output.write(True)
    with pytest.raises(DaqError) as error:
        reading(desk, "Dev1/port0/line1").read()
    assert error.value.error_code == -50103
    output.close()


def test_inputs_are_listed_where_there_are_some() -> None:
    with Desk([x_series(), *compact_rio()]) as desk:
        found = {device.name: device.di_lines.channel_names for device in desk.system.devices}
    assert len(found["Dev1"]) == 32
    assert found["cRIO1Mod5"] == [f"cRIO1Mod5/port0/line{k}" for k in range(8)]
    assert found["cRIO1Mod4"] == []


def test_a_module_without_inputs_has_no_such_channel() -> None:
    with Desk(compact_rio()) as desk, pytest.raises(DaqError) as error:
        reading(desk, "cRIO1Mod4/port0/line0")
    assert error.value.error_code == -200170
