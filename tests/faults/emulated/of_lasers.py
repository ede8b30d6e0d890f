"""Faults of the lasers on their serial lines."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from bench.events import State
from drivers.emulation.optoncdt.laser import EmulatedLaser
from tests.faults.emulated.fault import WiredFault, on, while_read
from tests.faults.fault import never, stays
from tests.faults.places import Place

LONG = 60.0


def _does(act: Callable[[EmulatedLaser], None], *storeys: int) -> Callable[[Any], None]:
    def begin(bench: Any) -> None:
        for storey in storeys or (1,):
            act(bench.laboratory.lasers[storey - 1])

    return begin


def _freeze(laser: Any) -> None:
    """Neither noise nor motion any more: the sensor repeats what it has just seen."""
    with laser._lock:
        place = laser._sensor.look(time.monotonic() - 0.05)
        laser._sensor._optics.shares = lambda displacement: np.full(displacement.size, place)


def _masters(value: float) -> Callable[[Any], None]:
    """Somebody presses the key at the sensor: where the storey stands is called `value` [m] from now on."""

    def act(laser: Any) -> None:
        with laser._lock:
            assert laser._sensor.master(value, time.monotonic() - 0.05)

    return act


def _driven(place: Place, bench: object) -> bool:  # noqa: ARG001 - the signature of every rule
    """The zero has been taken: before, a shift becomes part of it."""
    return place.state in (State.RUNNING, State.STOPPING)


def lasers() -> list[WiredFault]:
    """Unplugged, silent, out of range, frozen, with another zero, with garbage on the line."""
    fault = partial(WiredFault, connection="serial", reach=while_read)
    invalid = partial(fault, status="aborted", says="valid sample from laser_", must=stays, may=True)
    borne = partial(fault, status="completed", says="", must=never)
    return [
        fault("laser unplugged", _does(EmulatedLaser.unplug), "failed", "laser_1", on),
        fault("both lasers unplugged", _does(EmulatedLaser.unplug, 1, 2), "failed", "laser_", on),
        invalid("laser silent", _does(lambda laser: laser.silence(LONG))),
        invalid("both lasers silent", _does(lambda laser: laser.silence(LONG), 1, 2)),
        borne("laser silent a moment", _does(lambda laser: laser.silence(0.03), 2)),
        invalid("laser off", _does(EmulatedLaser.laser_off, 2)),
        invalid("target too close", _does(lambda laser: laser.target("too close"))),
        invalid("target too far", _does(lambda laser: laser.target("too far"), 2)),
        invalid("no target", _does(lambda laser: laser.target("none"))),
        invalid("half the bytes lost", _does(lambda laser: laser.lose_bytes(probability=0.5))),
        borne("a few bytes lost", _does(lambda laser: laser.lose_bytes(7), 2)),
        borne("garbage on the line", _does(lambda laser: laser.garbage(40))),
        fault("laser frozen", _does(_freeze, 2), "aborted", "constant count of laser_2", stays, True),
        fault("laser mastered", _does(_masters(0.09)), "aborted", "drift", _driven, True),
        # no limit is exceeded by it; the next program that opens the sensor refuses it
        borne("laser mastered by half a range", _does(_masters(0.05))),
    ]
