"""What a sensor says, as a script of commands and answers, and as values."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.optoncdt.codec import encode
from drivers.optoncdt.stream import Readings

INFO = b"""GETINFO ok\r
Name:            ILD1420-200\r
Serial:          15030002\r
Option:          000\r
Article:         4120212\r
Cable head:      Wire\r
Measuring range: 200.00mm\r
Version:         001.010\r
Hardware-rev:    00\r
Boot-version:    001.000\r
->"""
"""The manual's example, p. 97, with another range."""

Script = Sequence[tuple[bytes, bytes]]

SILENCED: Script = [(b"OUTPUT NONE", b"OUTPUT NONE ok\r\n->"), (b"GETINFO", INFO)]
CONFIGURED: Script = [
    (b"ECHO OFF", b"->"),
    (b"MASTERMV", b"MASTERMV NONE\r\n->"),
    (b"MEASRATE 4", b"->"),
    (b"MEASRATE", b"MEASRATE 4\r\n->"),
    (b"AVERAGE NONE", b"->"),
    (b"TRIGGER NONE", b"->"),
    (b"OUTHOLD NONE", b"->"),
    (b"OUTREDUCEDEVICE NONE", b"->"),
    (b"OUTADD_RS422 COUNTER TIMESTAMP", b"->"),
    (b"GETOUTINFO_RS422", b"GETOUTINFO_RS422 DIST1 COUNTER TIMESTAMP\r\n->"),
    (b"LASERPOW FULL", b"->"),
]
OPENED: Script = [*SILENCED, *CONFIGURED]
STARTED: Script = [(b"RESETCNT TIMESTAMP MEASCNT", b"->"), (b"OUTPUT RS422", b"->")]
STOPPED: Script = [(b"OUTPUT NONE", b"->")]


def replaced(script: Script, **answers: bytes) -> Script:
    """The script with other answers to the commands of these names, and nothing after them."""
    commands = [command.split()[0].decode() for command, _ in script]
    last = max(commands.index(name) for name in answers)
    return [(command, answers.get(name, answer)) for name, (command, answer) in zip(commands, script, strict=True)][
        : last + 1
    ]


def measurements(
    codes: Sequence[int] | NDArray[np.int32], first: int, ticks: int = 25, clock: bool = True
) -> list[bytes]:
    """What the sensor sends for each measurement: distance, counter, and time stamp in two halves if `clock`."""
    sent: list[bytes] = []
    for index, code in enumerate(codes, first):
        stamp = index * ticks % 2**32
        halves = (stamp & 0xFFFF, stamp >> 16) if clock else ()
        values = (index % 2**18, *halves)
        sent.append(encode(int(code), True) + b"".join(encode(value, False) for value in values))
    return sent


def joined(taken: Sequence[Readings]) -> Readings:
    """What several calls of `take` gave, as one."""
    return Readings(
        np.concatenate([one.index for one in taken]),
        np.concatenate([one.time for one in taken]),
        np.concatenate([one.code for one in taken]),
        np.concatenate([one.arrival for one in taken]),
    )
