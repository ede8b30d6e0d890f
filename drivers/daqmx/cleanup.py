"""Tasks that a dead client left on a gRPC device server.

The server keeps them for ever: nothing ties them to a connection. Their output holds its last value, their relay may
be closed, and nobody else gets the device.
"""

from collections.abc import Iterable
from contextlib import ExitStack

from nidaqmx.errors import DaqError, RpcError

from drivers.clock import WallClock
from drivers.daqmx import enable, heartbeat, inputs, library, output, safety_inputs, watchdog
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import status_of, translated
from drivers.errors import DeviceNotFound

_NAMES = (enable.NAME, heartbeat.NAME, output.NAME, inputs.NAME, safety_inputs.NAME, watchdog.NAME)
_WATCH = 0.6
"""How long a running output is watched [s]; a living client writes every 0.2 s."""
_LOOK = 0.05
"""Time between two looks [s]."""
_UNKNOWN = ("FAILED_PRECONDITION", "NOT_FOUND")
"""What a server says of a name that it does not know."""


def clear_stale(connection: Connection, devices: Iterable[str]) -> tuple[str, ...]:
    """Clear tasks of our names, and reset the devices if there were any; the names that were found.

    A client that is driving is left alone: DeviceNotFound. One that is idle cannot be told from a dead one: it loses
    its tasks, and its next `prepare` raises ConnectionLost.
    """
    if connection.server is None:
        # the driver of this PC clears the tasks of a process that ends
        return ()
    with translated("clearing tasks that another client left"):
        found = {name: task for name in _NAMES if (task := _attached(connection, name)) is not None}
        if output.NAME in found and _is_written(found[output.NAME]):
            raise DeviceNotFound(f"another client is driving the shaker through {connection.server}: end its run first")
        with ExitStack() as ending:
            # each is tried, whatever becomes of the others; the reset comes last
            if found:
                ending.callback(_reset, connection, devices)
            for task in found.values():
                ending.callback(task.close)
    return tuple(found)


def _reset(connection: Connection, names: Iterable[str]) -> None:
    """Reset the devices of these names, as far as they exist."""
    wanted = {name.lower() for name in names}
    with ExitStack() as resets:
        for device in library.system(connection.options()).devices:
            if device.name.lower() in wanted:
                resets.callback(device.reset_device)


def _attached(connection: Connection, name: str) -> library.Task | None:
    try:
        return library.task(name, connection.attaching(name))
    except RpcError as error:
        if status_of(error) in _UNKNOWN:
            return None
        raise


def _is_written(task: library.Task) -> bool:
    """Whether somebody appends samples to an output."""
    clock = WallClock()
    end = clock.now() + _WATCH
    try:
        before = task.out_stream.curr_write_pos
        while clock.now() < end:
            clock.wait_until(clock.now() + _LOOK)
            if task.out_stream.curr_write_pos != before:
                return True
    except DaqError:
        # an output that has run dry, or was never started, has nobody who writes
        return False
    return False
