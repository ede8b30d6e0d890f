"""One channel of an input task, and what it may be set to."""

from dataclasses import dataclass

from nidaqmx.constants import TerminalConfiguration
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.converter import InputConverter
from drivers.emulation.daqmx.device import AnalogInputs, DeviceModel, Wirings
from drivers.emulation.daqmx.errors import DaqmxFailure

_WIRING_OF = {
    TerminalConfiguration.RSE.value: Wirings.RSE,
    TerminalConfiguration.NRSE.value: Wirings.NRSE,
    TerminalConfiguration.DIFF.value: Wirings.DIFFERENTIAL,
    TerminalConfiguration.PSEUDO_DIFF.value: Wirings.PSEUDODIFFERENTIAL,
}


@dataclass(frozen=True)
class InputChannel:
    """One channel of an input task."""

    name: str
    device: DeviceModel
    inputs: AnalogInputs
    terminal: int
    minimum: float
    maximum: float
    converter: InputConverter


def require_wiring(inputs: AnalogInputs, wiring: int) -> None:
    """Raise DaqmxFailure when an input cannot be wired so."""
    if wiring != TerminalConfiguration.DEFAULT.value and not inputs.wirings & _WIRING_OF.get(wiring, Wirings(0)):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: AI.TermCfg\nRequested Value: {wiring}",
        )
