"""Two sets of devices, with the numbers of their data sheets."""

from dataclasses import replace

from nidaqmx.constants import ProductCategory

from drivers.emulation.daqmx.device import AnalogInputs, AnalogOutputs, DeviceModel, Wirings

_CALIBRATED = 2
"""The input whose calibration is not straight, where one is: that of the first laser's analogue output."""
_BEND = 1.0e-4
"""What the square and the cube of its calibration each make at the end of the range, relative to the range."""


def x_series(name: str = "Dev1", *, simulated: bool = False, calibrated: bool = False) -> DeviceModel:
    """A multifunction device at the USB port, after the data sheet of the USB-6363.

    `calibrated`, one input has a calibration polynomial with offset, slope error, square and cube.
    """
    return DeviceModel(
        name,
        "USB-6363",
        category=ProductCategory.X_SERIES_DAQ,
        serial=0x01C0FFEE,
        simulated=simulated,
        inputs=AnalogInputs(
            count=32,
            ranges=(10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1),
            rate=2.0e6,
            total_rate=1.0e6,
            simultaneous=False,
            wirings=Wirings.RSE | Wirings.NRSE | Wirings.DIFFERENTIAL,
            polynomials=_polynomials(16) if calibrated else {},
        ),
        outputs=AnalogOutputs(count=4, ranges=(10.0, 5.0), rate=2.86e6, memory=8191),
        lines=32,
        input_lines=32,
        watchdog=34.0,
    )


def compact_rio(name: str = "cRIO1", *, simulated: bool = False, calibrated: bool = False) -> tuple[DeviceModel, ...]:
    """A cRIO-9045 with two NI 9239 (inputs), NI 9263 (outputs), NI 9485 (relays) and NI 9421 (digital inputs).

    Modules are devices of their own: `cRIO1Mod1/ai0`; triggers are the controller's: `/cRIO1/te0/StartTrigger`. A
    CompactRIO has no watchdog that DAQmx could set. `calibrated` as of `x_series`, for the first module.
    """
    first = replace(_ni_9239(0), polynomials=_polynomials(24)) if calibrated else _ni_9239(0)
    slots = (
        DeviceModel("", "NI 9239", inputs=first),
        DeviceModel("", "NI 9239", inputs=_ni_9239(4)),
        DeviceModel("", "NI 9263", outputs=AnalogOutputs(count=4, ranges=(10.0,), rate=1.0e5, memory=127)),
        DeviceModel("", "NI 9485", lines=8),
        DeviceModel("", "NI 9421", input_lines=8),
    )
    modules = tuple(
        replace(
            module,
            name=f"{name}Mod{slot}",
            category=ProductCategory.C_SERIES_MODULE,
            serial=0x01D00000 + slot,
            simulated=simulated,
            chassis=name,
        )
        for slot, module in enumerate(slots, 1)
    )
    controller = DeviceModel(
        name,
        "cRIO-9045",
        category=ProductCategory.COMPACT_RIO_CHASSIS,
        serial=0x01D00000,
        simulated=simulated,
        modules=tuple(module.name for module in modules),
    )
    return controller, *modules


def _ni_9239(first_terminal: int) -> AnalogInputs:
    """Four simultaneous inputs of 24 bits in raw samples of 32 (NI 9239 data sheet)."""
    return AnalogInputs(
        count=4,
        ranges=(10.0,),
        rate=5.0e4,
        total_rate=5.0e4,
        simultaneous=True,
        wirings=Wirings.DIFFERENTIAL,
        resolution=24,
        raw_bits=32,
        first_terminal=first_terminal,
    )


def _polynomials(bits: int, span: float = 10.0) -> dict[int, tuple[float, ...]]:
    """Volts per power of the counts for the one input that is not straight, of `bits` over +-`span` volts."""
    full = 2.0 ** (bits - 1)
    return {_CALIBRATED: (5e-5 * span, (1.0 + 2e-4) * span / full, _BEND * span / full**2, -_BEND * span / full**3)}
