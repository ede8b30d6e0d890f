"""What can go wrong with the file of a campaign once it has been accepted."""

import re
from collections.abc import Generator
from contextlib import contextmanager

from sim.errors import RockbenchError


class RecordError(RockbenchError):
    """The file could not be written or read further; what was complete before stays readable."""

    error_code = "data_file"


UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, TypeError, IndexError, OverflowError, RecordError)
"""What reading a damaged file raises: errors of HDF5, of its Python library, and of the decoding of what it holds."""


def reason(error: BaseException) -> str:
    """One line for an error of the HDF5 library, which reports over several: the system's own words if it has them."""
    text = str(error).strip()
    found = re.search(r"error message = '([^']+)'", text)
    return found.group(1) if found else text.partition("\n")[0] or type(error).__name__


@contextmanager
def reading(what: str) -> Generator[None]:
    """Make a RecordError that names `what` of all that reading a damaged file raises."""
    try:
        yield
    except RecordError:
        raise
    except UNREADABLE as error:
        raise RecordError(f"{what} cannot be read ({reason(error)}): the file is damaged") from error
