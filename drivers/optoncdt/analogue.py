"""The analogue output of the sensor: 4 to 20 mA, made a voltage by a load resistor."""

from dataclasses import dataclass

from sim.errors import InvalidInput

_START, _END = 0.004, 0.020
"""Current at the start and at the end of the measuring range [A] (manual, p. 116)."""
_LOWEST, _HIGHEST = 0.0038, 0.0202
"""Currents between which the output is a distance, the reserve included [A] (manual of the IFD2410, p. 71, of the
same family). Where there is no distance the current is lower, 3 to 3.75 mA depending on the model."""


@dataclass(frozen=True)
class AnalogueScaling:
    """value = (volts - middle) * slope: from mid range [m], with `slope` in m/V. `valid` are the volts of distances."""

    slope: float
    middle: float
    valid: tuple[float, float]


def laser_scaling(measuring_range: float, load: float) -> AnalogueScaling:
    """How volts over `load` [ohm] become metres, for the standard scaling of the output.

    Source: d = (I - 4 mA) / 16 mA of the measuring range (manual of the IFD2410, p. 71; of the optoNCDT 1402, p. 31).
    """
    slope = measuring_range / ((_END - _START) * load)
    return AnalogueScaling(slope, 0.5 * (_START + _END) * load, (_LOWEST * load, _HIGHEST * load))


def require_input_range(item: str, input_range: float, load: float) -> None:
    """Raise InvalidInput, about `item`, when an input of +-`input_range` [V] does not hold the measuring range.

    The reserve beyond it may be cut off by the converter's rail: a value there is then invalid.
    """
    if (needed := _END * load) > input_range * (1.0 + 1e-9):
        allowed = (
            f"the output of the laser reaches {needed:.4g} V over {load:g} ohm;"
            f" choose a wider input range, or a load of {input_range / _END:.0f} ohm at most"
        )
        raise InvalidInput(item, input_range, allowed)
