"""Serial line of a streaming sensor, read by a separate process.

A port buffers only a few thousand bytes, about a tenth of a second at the full rate. The process time-stamps the bytes
on arrival and keeps them while this program is stalled, so that no values are lost.

The process writes frames: arrival time on the machine's clock [s] (float64), number of bytes (uint32), and the bytes. A
frame whose time is NaN contains the text of the error that ended the process; an empty frame reports that the port is
open.
"""

import queue
import struct
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from math import isnan, nan
from typing import IO

from serial import Serial

from drivers.child import ChildProcess, ignore_requests
from drivers.clock import now
from drivers.errors import ConnectionLost, DeviceNotFound
from drivers.optoncdt.port import open_port

_HEAD = struct.Struct("<dI")
_PACE = 0.0025
"""Pause between two reads of the line [s]; the cost of a read does not depend on the number of bytes.

With frequent reads, some follow an arrival closely, which improves the estimate of the sensor's clock.
"""


class Line:
    """The process that reads `port` at `baud`; the port must not be open in this program. `who` identifies the sensor
    in errors. Methods may be called from any thread.

    Raises DeviceNotFound if the port cannot be opened.
    """

    def __init__(self, who: str, port: str, baud: int) -> None:
        self._who = who
        self._child = ChildProcess("drivers.optoncdt.line", who, port, str(baud))
        try:
            next(self._frames())
        except (ConnectionLost, StopIteration) as error:
            self.close()
            self.release()
            raise DeviceNotFound(str(error) or f"{who}: the reading process ended at once; try again") from error
        except BaseException:
            self.close()
            self.release()
            raise

    def write(self, sent: bytes) -> None:
        """Send bytes to the sensor. Raises OSError if the process has ended."""
        self._child.write(sent)

    def chunks(self) -> Iterator[tuple[bytes, float]]:
        """Received bytes and their arrival times on the machine's clock [s], until `close`. Raises ConnectionLost if
        the port has disappeared.
        """
        return self._frames()

    def close(self) -> None:
        """End the process and release the port; may be called repeatedly."""
        self._child.end()

    def release(self) -> None:
        """Close the pipe from the process. To be called after the last use of `chunks`."""
        with suppress(OSError):
            self._child.output.close()

    def _frames(self) -> Iterator[tuple[bytes, float]]:
        while len(head := self._child.output.read(_HEAD.size)) == _HEAD.size:
            arrival, size = _HEAD.unpack(head)
            content = self._child.output.read(size)
            if isnan(arrival):
                raise ConnectionLost(content.decode(errors="replace"))
            yield content, arrival


def _serve(who: str, name: str, baud: int, commands: IO[bytes], frames: IO[bytes]) -> None:
    """Read the port until `commands` ends; another thread writes the frames, so that a full pipe never delays a
    read.
    """
    pending: queue.SimpleQueue[tuple[bytes, float] | None] = queue.SimpleQueue()
    writer = threading.Thread(target=_write, args=(pending, frames))
    writer.start()
    over = threading.Event()
    try:
        with open_port(who, name, baud) as port:
            pending.put((b"", now()))
            threading.Thread(target=_forward, args=(commands, port, over), daemon=True).start()
            while not over.is_set():
                time.sleep(_PACE)
                # bytes already buffered may be old, so the read waits for the next byte, whose arrival time is known
                chunk = port.read(port.in_waiting) + port.read(1)
                chunk += port.read(port.in_waiting)
                if chunk:
                    pending.put((chunk, now()))
    except DeviceNotFound as error:
        pending.put((str(error).encode(), nan))
    except Exception as error:
        # pyserial raises various errors when a port disappears
        message = f"{who} was disconnected ({error}); plug it in, check its power, and reopen it"
        pending.put((message.encode(), nan))
    finally:
        pending.put(None)
        writer.join()


def _write(pending: "queue.SimpleQueue[tuple[bytes, float] | None]", frames: IO[bytes]) -> None:
    # the receiving program may have ended
    with suppress(OSError):
        while (one := pending.get()) is not None:
            chunk, arrival = one
            frames.write(_HEAD.pack(arrival, len(chunk)) + chunk)
            frames.flush()


def _forward(commands: IO[bytes], port: Serial, over: threading.Event) -> None:
    """Pass commands on to the port until the program that sends them closes the pipe or ends."""
    with suppress(OSError, ValueError):
        while command := commands.readline():
            port.write(command)
    over.set()


if __name__ == "__main__":
    ignore_requests()
    _serve(sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.stdin.buffer, sys.stdout.buffer)
