"""All that can go wrong on the emulated bench."""

from tests.faults import of_instruments, of_people
from tests.faults.emulated.fault import WiredFault, anywhere, before, struck, wired
from tests.faults.emulated.of_daq import cables, daq
from tests.faults.emulated.of_lasers import lasers
from tests.faults.emulated.of_safety import safety

_CLOCKS = ("clock jumps ahead", "clock jumps back", "gap", "short block", "block twice")
"""Faults of time and order that no instrument of the laboratory makes: put in between driver and guard."""


def _people() -> list[WiredFault]:
    """Plans, subscribers, disks, operators, requests: as on the simulated bench."""
    requests = [wired(fault, reach=anywhere) for fault in of_people.requests()]
    return [
        *(wired(fault, fired=struck, reach=before("running again")) for fault in of_people.plans()),
        *(wired(fault, fired=struck, reach=anywhere) for fault in of_people.subscribers()),
        *(wired(fault, reach=anywhere) for fault in of_people.disks()),
        *requests,
    ]


def catalogue() -> list[WiredFault]:
    """Every fault once."""
    clocks = [wired(fault, fired=struck) for fault in of_instruments.timing() if fault.name in _CLOCKS]
    return [*daq(), *cables(), *safety(), *lasers(), *clocks, *_people()]
