"""What this driver asks of nidaqmx is there, with the arguments that are passed."""

import inspect
from typing import Any

import nidaqmx.system
import pytest
from nidaqmx.stream_readers import AnalogUnscaledReader
from nidaqmx.stream_writers import AnalogSingleChannelWriter, DigitalSingleChannelWriter
from nidaqmx.system.device import Device
from nidaqmx.system.physical_channel import PhysicalChannel
from nidaqmx.system.watchdog import WatchdogTask
from nidaqmx.task import InStream, OutStream, Task, Timing
from nidaqmx.task.channels import AIChannel, AOChannel
from nidaqmx.task.collections import AIChannelCollection, AOChannelCollection, DOChannelCollection
from nidaqmx.task.triggering import StartTrigger, Triggers
from nidaqmx.types import DriverVersion

from drivers.daqmx import library

PAIRS = [
    (library.Device, Device),
    (library.PhysicalInput, PhysicalChannel),
    (library.System, nidaqmx.system.System),
    (library.Version, DriverVersion),
    (library.Task, Task),
    (library.WatchdogTask, WatchdogTask),
    (library.InputChannels, AIChannelCollection),
    (library.OutputChannels, AOChannelCollection),
    (library.LineChannels, DOChannelCollection),
    (library.InputChannel, AIChannel),
    (library.OutputChannel, AOChannel),
    (library.Timing, Timing),
    (library.StartTrigger, StartTrigger),
    (library.Triggers, Triggers),
    (library.InStream, InStream),
    (library.OutStream, OutStream),
    (library.UnscaledReader, AnalogUnscaledReader),
    (library.AnalogWriter, AnalogSingleChannelWriter),
    (library.LineWriter, DigitalSingleChannelWriter),
]


def members(described: type[Any]) -> dict[str, Any]:
    """Names that a description promises, with what stands there."""
    promised = dict.fromkeys(getattr(described, "__annotations__", {}))
    return promised | {name: value for name, value in vars(described).items() if not name.startswith("_")}


@pytest.mark.parametrize(("described", "real"), PAIRS, ids=lambda each: each.__name__)
def test_the_real_class_has_what_is_described(described: type[Any], real: type[Any]) -> None:
    assert members(described)
    for name, member in members(described).items():
        assert hasattr(real, name), name
        if inspect.isfunction(member):
            there = inspect.signature(getattr(real, name)).parameters
            assert set(inspect.signature(member).parameters) <= set(there), name
        else:
            assert not inspect.isfunction(getattr(real, name)), name
