"""A real optoNCDT 1420 that looks at something: run with `pytest -m laser_hardware`.

ROCKBENCH_LASER_PORT is its serial port; where there are such things ROCKBENCH_LASER_BAUD is its baud rate and
ROCKBENCH_LASER_RATE the measuring rate [1/s].
"""

import os
import time
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.optoncdt.codec import LASER_OFF, marked
from drivers.optoncdt.search import find_lasers
from drivers.optoncdt.sensor import SerialLaser
from drivers.optoncdt.stream import Readings

DURATION = 10.0
DEADLINE = 20.0

pytestmark = pytest.mark.laser_hardware


@pytest.fixture(autouse=True)
def _asked_for(request: pytest.FixtureRequest) -> None:
    if "laser_hardware" not in str(request.config.option.markexpr):
        pytest.skip("needs an optoNCDT 1420: run with -m laser_hardware")
    if "ROCKBENCH_LASER_PORT" not in os.environ:
        pytest.skip("needs ROCKBENCH_LASER_PORT: the serial port of the sensor")


def rate() -> float:
    return float(os.environ.get("ROCKBENCH_LASER_RATE", "4000"))


@pytest.fixture
def laser() -> Iterator[SerialLaser]:
    port = os.environ["ROCKBENCH_LASER_PORT"]
    (found,) = find_lasers([port])
    assert found.info is not None, found.problem
    baud = os.environ.get("ROCKBENCH_LASER_BAUD")
    measuring_range = found.info.measuring_range
    with SerialLaser(
        "laser_1", port, baud=int(baud) if baud else None, rate=rate(), measuring_range=measuring_range
    ) as one:
        yield one


def taken_for(laser: SerialLaser, seconds: float) -> list[Readings]:
    """What comes in so many seconds."""
    taken: list[Readings] = []
    end = time.perf_counter() + seconds
    while (left := end - time.perf_counter()) > 0.0:
        laser.wait(left)
        taken.append(laser.take())
    return taken


def test_it_says_who_it_is(laser: SerialLaser) -> None:
    assert laser.info.supported
    assert laser.info.serial
    assert 0.005 <= laser.info.measuring_range <= 0.5


def test_ten_seconds_come_without_loss_and_at_the_nominal_rate(laser: SerialLaser) -> None:
    laser.start()
    taken = taken_for(laser, DURATION)
    index = np.concatenate([one.index for one in taken])
    seconds = np.concatenate([one.time for one in taken])
    assert (np.diff(index) == 1).all()
    assert (seconds[-1] - seconds[0]) / (index[-1] - index[0]) == pytest.approx(1.0 / rate(), rel=1e-3)
    assert index.size == pytest.approx(DURATION * rate(), rel=0.05)


def test_the_beam_goes_off_and_on_again(laser: SerialLaser) -> None:
    laser.start()
    laser.laser(False)
    assert _eventually(laser, off=True)
    laser.laser(True)
    assert _eventually(laser, off=False)


def _eventually(laser: SerialLaser, *, off: bool) -> bool:
    """Whether the newest value soon says that the laser is off, or that it is not."""
    deadline = time.perf_counter() + DEADLINE
    while time.perf_counter() < deadline:
        laser.wait(1.0)
        code = laser.take().code
        if code.size and (marked(code[-1:])[0] == LASER_OFF) == off:
            return True
    return False
