"""Causes of missing samples are named by the count that the channel reports, with a remedy that fits."""

import pytest

from bench.engine.steps import Measured
from drivers.hardware.channels import serial_laser
from drivers.optoncdt.codec import LATE, LOST, MEANINGS, NO_PEAK
from protocols.common.calibrate import Unmeasurable, complete_cycles
from protocols.common.missing import cause
from sim.channel import Channel

LASER = serial_laser("laser_1", 0.2, 1, "ILD1420-200", MEANINGS)
SENSOR = Channel("table_displacement", "displacement", "m", 1e-5, 0.0, (-8000, 8000), "a sensor")


@pytest.mark.parametrize(
    ("channel", "count", "at_rest", "named", "remedy"),
    [
        (LASER, LATE, False, "arrived after its block was due", "close other programs"),
        (LASER, LOST, False, "lost on the line", "latency timer"),
        (LASER, NO_PEAK, True, "no reflection detected", "check that the laser is on"),
        (LASER, NO_PEAK, False, "no reflection detected", "reduce the motion"),
        (SENSOR, 8191, False, "beyond the upper end of its range", "range of the input"),
        (SENSOR, -8192, True, "beyond the lower end of its range", "range of the input"),
        # the same count as LATE has no such meaning on another channel
        (SENSOR, LATE, False, "beyond the upper end of its range", "range of the input"),
    ],
)
def test_the_cause_and_its_remedy(channel: Channel, count: int, at_rest: bool, named: str, remedy: str) -> None:
    said = cause(channel, count, at_rest=at_rest)
    assert named in said
    assert remedy in said


def test_cycles_that_are_missing_because_values_were_late_do_not_blame_the_sensors_range() -> None:
    with pytest.raises(Unmeasurable, match="4 of 4 cycles have missing samples of laser_1") as refused:
        complete_cycles(Measured((), (LASER, LATE)), 4)
    assert "close other programs" in str(refused.value)
    assert "range" not in str(refused.value)
