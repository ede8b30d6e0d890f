"""All that can go wrong."""

from tests.faults.fault import Fault
from tests.faults.of_instruments import calls, motion, safety, sensors, timing
from tests.faults.of_people import disks, operators, plans, requests, subscribers


def catalogue() -> list[Fault]:
    """Every fault once."""
    kinds = (sensors, motion, timing, calls, safety, plans, subscribers, disks, operators, requests)
    return [fault for kind in kinds for fault in kind()]
