"""What can go wrong with the file of a campaign once it has been accepted."""

import re

from sim.errors import RockbenchError


class RecordError(RockbenchError):
    """The file could not be written or read further; what was complete before stays readable."""


def reason(error: BaseException) -> str:
    """One line for an error of the HDF5 library, which reports over several: the system's own words if it has them."""
    text = str(error).strip()
    found = re.search(r"error message = '([^']+)'", text)
    return found.group(1) if found else text.partition("\n")[0] or type(error).__name__
