"""Removal of tasks left on a gRPC device server by a client that has crashed.

The server keeps tasks indefinitely, independently of connections. Their output holds its last value, the enable relay
may be closed, and no other client can use the device.
"""

from collections.abc import Iterable
from contextlib import ExitStack

from nidaqmx.errors import DaqError, RpcError

from drivers.clock import WallClock
from drivers.daqmx import inputs, library, marker, output
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import status_of, translated
from drivers.daqmx.safety import (
    ENABLE_TASK,
    HEARTBEAT_TASK,
    SAFETY_TASK,
    WATCHDOG_TASK,
)
from drivers.errors import DeviceNotFound

_OURS = (ENABLE_TASK, HEARTBEAT_TASK, output.NAME, inputs.NAME, SAFETY_TASK, WATCHDOG_TASK, marker.NAME)

_WATCH = 0.6
"""Time for which a running output is observed [s]; an active client writes once per block, which lasts 0.1 s by default
and at most 0.2 s.
"""

_POLL = 0.05
"""Time between two readings of the output's write position [s]."""

_UNKNOWN = ("FAILED_PRECONDITION", "NOT_FOUND")
"""Status codes with which a server rejects the name of a task that does not exist."""


def clear_stale(connection: Connection, devices: Iterable[str]) -> tuple[str, ...]:
    """Clear existing tasks that have this program's names, and then reset the devices; returns the names found.

    Raises DeviceNotFound while another client drives the output. An idle client cannot be distinguished from a crashed
    one: it loses its tasks, and its next `prepare` raises ConnectionLost.
    """
    if connection.server is None:
        # the local driver clears the tasks of a process that ends
        return ()
    with translated("clearing tasks that another client left"):
        found = {name: task for name in _OURS if (task := _attached(connection, name)) is not None}
        if output.NAME in found and _is_written(found[output.NAME]):
            raise DeviceNotFound(f"another client drives the shaker through {connection.server}: end its run first")
        with ExitStack() as ending:
            # clear all even if one fails, then reset
            if found:
                ending.callback(_reset, connection, devices)
            for task in found.values():
                ending.callback(task.close)
    return tuple(found)


def _reset(connection: Connection, names: Iterable[str]) -> None:
    """Reset the named devices that exist."""
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
    """Whether a client is appending samples to an output."""
    clock = WallClock()
    end = clock.now() + _WATCH
    try:
        before = task.out_stream.curr_write_pos
        while clock.now() < end:
            clock.wait_until(clock.now() + _POLL)
            if task.out_stream.curr_write_pos != before:
                return True
    except DaqError:
        # an output that has underflowed or was never started has no active client
        return False
    return False
