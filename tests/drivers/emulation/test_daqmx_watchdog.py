"""The watchdog of the emulated device: it opens the relay when nobody says that all is well."""

from collections.abc import Iterator
from typing import Any

import pytest
from nidaqmx.constants import Level
from nidaqmx.errors import DaqError
from nidaqmx.system.watchdog import AOExpirationState, DOExpirationState

from drivers.emulation.daqmx.models import compact_rio, x_series
from tests.drivers.emulation.daqmx_loopback import Desk
from tests.patience import eventually

RELAY = "Dev1/port0/line0"


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk() as desk:
        yield desk


def watched(desk: Desk, timeout: float) -> tuple[Any, Any]:
    """A watchdog that runs, and the relay closed after it."""
    watchdog, line = desk.watchdog(timeout), desk.task("enable")
    watchdog.cfg_watchdog_do_expir_states([DOExpirationState(physical_channel=RELAY, expiration_state=Level.LOW)])
    line.do_channels.add_do_chan(RELAY)
    watchdog.start()
    line.write(True)
    assert desk.plant.enabled
    return watchdog, line


def test_it_opens_the_relay_and_bars_the_line_until_it_is_cleared(desk: Desk) -> None:
    watchdog, line = watched(desk, 0.8)
    eventually(lambda: not desk.plant.enabled)
    assert watchdog.expired
    with pytest.raises(DaqError) as error:
        line.write(True)
    assert error.value.error_code == -200678
    with pytest.raises(DaqError) as error:
        watchdog.reset_timer()
    assert error.value.error_code == -200644
    assert not desk.plant.enabled
    watchdog.clear_expiration()
    assert not watchdog.expired
    # the line is what was written last, and can be written again
    assert desk.plant.enabled
    line.write(False)
    assert not desk.plant.enabled


def test_it_stays_quiet_as_long_as_it_is_told(desk: Desk) -> None:
    watchdog, _ = watched(desk, 5.0)
    for _ in range(10):
        desk.plant.pass_ticks(20)
        watchdog.reset_timer()
    assert desk.plant.enabled
    assert not watchdog.expired
    watchdog.stop()
    assert desk.plant.enabled


def test_it_watches_though_the_server_is_gone(desk: Desk) -> None:
    watched(desk, 1.0)
    desk.server.vanish()
    eventually(lambda: not desk.plant.enabled)


def test_a_reset_of_the_device_ends_the_watch(desk: Desk) -> None:
    watchdog, line = watched(desk, 0.8)
    eventually(lambda: watchdog.expired)
    desk.system.devices["Dev1"].reset_device()
    line.write(True)
    assert desk.plant.enabled


def test_nothing_else_may_be_reserved_when_it_starts(desk: Desk) -> None:
    desk.inputs().start()
    with pytest.raises(DaqError) as error:
        desk.watchdog(1.0).start()
    assert error.value.error_code == -201477


@pytest.mark.parametrize(("timeout", "code"), [(35.0, -200668), (0.0, -200668)])
def test_time_outs_that_it_has_not_are_refused(desk: Desk, timeout: float, code: int) -> None:
    with pytest.raises(DaqError) as error:
        desk.watchdog(timeout)
    assert error.value.error_code == code


def test_it_has_no_states_for_analogue_outputs(desk: Desk) -> None:
    from nidaqmx.constants import WatchdogAOExpirState

    states = [
        AOExpirationState(physical_channel="Dev1/ao0", expiration_state=0.0, output_type=WatchdogAOExpirState.VOLTAGE)
    ]
    with pytest.raises(DaqError) as error:
        desk.watchdog(1.0).cfg_watchdog_ao_expir_states(states)
    assert error.value.error_code == -200452


def test_a_controller_has_none() -> None:
    with Desk(compact_rio()) as desk, pytest.raises(DaqError) as error:
        desk.watchdog(1.0, "cRIO1Mod4")
    assert error.value.error_code == -200662


def test_that_of_a_simulated_device_never_expires() -> None:
    with Desk([x_series(simulated=True)]) as desk:
        watchdog, _ = watched(desk, 0.05)
        desk.plant.pass_ticks(400)
        assert desk.plant.enabled
        assert not watchdog.expired
