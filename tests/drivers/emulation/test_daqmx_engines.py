"""Timing engines of a chassis: which one a task has is open until the task is reserved."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from nidaqmx.constants import AcquisitionType, TaskMode
from nidaqmx.errors import DaqError

from drivers.emulation.daqmx.models import compact_rio
from tests.drivers.emulation.daqmx_loopback import Desk

NOT_RESERVED = -200983
Query = Callable[[Any], object]
QUERIES: dict[str, Query] = {
    "trigger": lambda task: task.triggers.start_trigger.term,
    "clock": lambda task: task.timing.samp_clk_term,
    "engine": lambda task: task.timing.samp_timing_engine,
}


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk(compact_rio()) as desk:
        yield desk


def refused(query: Query, task: Any) -> int:
    with pytest.raises(DaqError) as error:
        query(task)
    return int(error.value.error_code)


@pytest.mark.parametrize("query", QUERIES.values(), ids=QUERIES)
def test_terminals_are_undefined_until_the_task_is_reserved(desk: Desk, query: Query) -> None:
    task = desk.inputs("cRIO1Mod1/ai0")
    assert refused(query, task) == NOT_RESERVED
    task.control(TaskMode.TASK_RESERVE)
    assert query(task) in ("/cRIO1/it0/StartTrigger", "/cRIO1/it0/SampleClock", 0)
    task.control(TaskMode.TASK_UNRESERVE)
    assert refused(query, task) == NOT_RESERVED


def test_the_client_may_choose_the_engine_instead(desk: Desk) -> None:
    task = desk.inputs("cRIO1Mod1/ai0")
    task.timing.samp_timing_engine = 3
    assert task.triggers.start_trigger.term == "/cRIO1/it3/StartTrigger"
    with pytest.raises(DaqError) as error:
        task.timing.samp_timing_engine = 8
    assert error.value.error_code == -200077


def test_a_second_task_takes_the_next_engine(desk: Desk) -> None:
    first, second = desk.task("first"), desk.task("second")
    for task, module in ((first, "cRIO1Mod1"), (second, "cRIO1Mod2")):
        task.ai_channels.add_ai_voltage_chan(f"{module}/ai0")
        task.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        task.control(TaskMode.TASK_RESERVE)
    assert second.timing.samp_clk_term == "/cRIO1/it1/SampleClock"


def test_a_device_with_one_engine_names_its_terminals_at_once() -> None:
    with Desk() as desk:
        task = desk.inputs()
        assert task.triggers.start_trigger.term == "/Dev1/ai/StartTrigger"
        assert refused(QUERIES["engine"], task) == -200452
