"""From raw counts to volts, and which counts are measurements."""

from dataclasses import dataclass

from nidaqmx.constants import DataJustification

from drivers.daqmx.library import InputChannel
from drivers.errors import RigError


@dataclass(frozen=True)
class InputScaling:
    """One input: volts = coefficients[0] + coefficients[1] counts + coefficients[2] counts^2 + ...

    The coefficients are the device's own calibration. Counts from `lowest` to `highest` are measurements; beyond, the
    converter is at its rail. `bits` is the size of a raw sample.
    """

    coefficients: tuple[float, ...]
    lowest: int
    highest: int
    bits: int


def scaling_of(channel: InputChannel, terminal: str) -> InputScaling:
    """How the device scales an input of a task. Raises RigError when it gives no slope."""
    coefficients = tuple(float(c) for c in channel.ai_dev_scaling_coeff)
    if len(coefficients) < 2 or coefficients[1] == 0.0:
        raise RigError(f"{terminal} cannot be scaled: its device gives the coefficients {coefficients}; recalibrate it")
    size = int(channel.ai_raw_samp_size)
    left = channel.ai_raw_samp_justification is DataJustification.LEFT
    return InputScaling(coefficients, *valid_counts(size, round(channel.ai_resolution), left=left), size)


def valid_counts(size: int, resolution: int, *, left: bool) -> tuple[int, int]:
    """Lowest and highest count between the rails of a signed converter of `resolution` bits in `size` bits.

    A count at the rail may mean any voltage beyond, so the range ends one count inward. `left` says that the
    converter's bits are the upper ones of the sample.
    """
    step = 2 ** (size - resolution) if left else 1
    rail = 2 ** (resolution - 1)
    return (1 - rail) * step, (rail - 2) * step
