"""Both lasers against the table on a clamped frame: delay, sign and scale through the whole emulated laboratory."""

import sys
from typing import Any

import numpy as np
import pytest

from bench.testing.conformance import play, started
from drivers.emulation.laboratory import Connection, Laboratory
from drivers.hardware.parameters import Hardware
from drivers.hardware.rig import HardwareRig
from drivers.rig import OperatorTask
from drivers.timebase.common_motion import CommonMotion, common_motion
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.drivers.lines import complex_amplitudes

LEAD = 600
BLOCK = 200
OMEGA = 2.0 * np.pi * np.array([1.0, 1.75, 2.5, 3.25, 4.0])
SETTLED, MEASURED = 1000, 2600
"""Samples: after half a second the start is over, what follows holds a turn of the slowest sine."""
SERIAL = pytest.mark.skipif(sys.platform == "win32", reason="emulated serial lasers need pseudo-terminals")


def compared(connection: Connection, **changes: dict[str, Any]) -> tuple[CommonMotion, CommonMotion, float]:
    """What the lasers show of the table's motion, and the delay of the filters less the lasers' own latency [s].

    `changes` are made to groups of the client's configuration.
    """
    parameters = VirtualBenchParameters()
    with Laboratory(parameters, Specimen(), seed=1, connection=connection) as laboratory:
        hardware = laboratory.hardware
        groups = {"lasers": {"observation_time": 1.0, **changes.pop("lasers", {})}, **changes}
        made = {name: getattr(hardware, name).model_copy(update=new) for name, new in groups.items()}
        with HardwareRig(Hardware.model_validate(dict(hardware) | made), lead=LEAD) as rig:
            rig.perform(OperatorTask.LOCK_FRAME)
            time = np.arange(SETTLED + MEASURED) / rig.sample_rate
            rising = 0.25 * np.minimum(2.0 * time, 1.0)
            volts = rising * np.sin(np.outer(time, OMEGA) + np.arange(OMEGA.size)).sum(axis=1)
            blocks = play(started(rig), volts, BLOCK)
            names = [channel.name for channel in rig.channels]
            counts = np.concatenate([block.counts for block in blocks])[SETTLED:]
            table, first, second = (
                complex_amplitudes(rig.channels[k].to_unit(counts[:, k]), rig.sample_rate, OMEGA)
                for k in map(names.index, ("table_displacement", "laser_1", "laser_2"))
            )
    return common_motion(OMEGA, table, first), common_motion(OMEGA, table, second), hardware.lasers.delay


@pytest.mark.parametrize("connection", [pytest.param("serial", marks=[SERIAL, pytest.mark.milliseconds]), "analogue"])
def test_lasers_show_the_tables_motion_at_its_time(connection: Connection) -> None:
    """The table's channel lags by its filter, the laser by its own latency: the difference is what is configured."""
    *both, configured = compared(connection)
    assert connection == "analogue" or configured > 2e-3
    for found in both:
        assert found.polarity == 1
        assert found.scale == pytest.approx(1.0, rel=0.02)
        assert abs(found.delay) < 1e-3


@SERIAL
@pytest.mark.milliseconds
@pytest.mark.soak
def test_serial_lasers_without_a_configured_delay_are_early_by_it() -> None:
    first, second, configured = compared("serial", lasers={"delay": 0.0})
    assert configured > 2e-3
    assert first.delay == pytest.approx(-configured, abs=1e-3)
    assert second.delay == pytest.approx(-configured, abs=1e-3)


def test_what_is_configured_wrongly_shows() -> None:
    """The sign of a laser, the sensitivity of the table's transducer and its sign."""
    first, second, _ = compared("analogue", laser_1={"polarity": -1}, table_displacement={"sensitivity": -200.0})
    sensitivity = 1.0 / VirtualBenchParameters().displacement_sensor.nominal[0]
    assert (first.polarity, second.polarity) == (1, -1)
    assert first.scale == pytest.approx(200.0 / sensitivity, rel=0.02)
