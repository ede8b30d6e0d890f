"""Which of its ranges a device chooses."""

from collections.abc import Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure


def covering_range(ranges: Sequence[float], minimum: float, maximum: float, what: str) -> float:
    """The narrowest of the device's ranges [V] that holds the limits. Raises DaqmxFailure when none does."""
    wanted = max(abs(minimum), abs(maximum))
    if minimum >= maximum or wanted > max(ranges):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: {what}\nRequested Limits: {minimum} to {maximum}",
        )
    return min(range for range in ranges if range >= wanted)
