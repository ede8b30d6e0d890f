"""Models of National Instruments devices, with the specifications and rules given in NI's documents.

Except where noted, the tables are taken from the documents alone, independently of the assumptions of this program's
drivers.
"""

from collections.abc import Sequence
from dataclasses import replace

from nidaqmx.constants import ProductCategory

from drivers.emulation.daqmx.conversion import DeltaSigma
from drivers.emulation.daqmx.device import AnalogInputs, AnalogOutputs, DeviceModel, Wirings
from sim.errors import InvalidInput

_FILTER = 40.0 + 5.0 / 512.0
"""Input delay of the delta-sigma modules of this generation in samples (NI knowledge base, kA00Z0000004A0YSAU)."""

_SINGLE_ENDED = Wirings.RSE | Wirings.NRSE | Wirings.DIFFERENTIAL
_MODULE_MEMORY = 127
"""Capacity of a slot's output FIFO without regeneration [samples] (NI cDAQ-9174 Specifications, "Analog Output",
"AO FIFO").
"""


def _outputs() -> AnalogOutputs:
    return AnalogOutputs(count=4, ranges=(10.0,), rate=1.0e5, memory=_MODULE_MEMORY)


MODULES: dict[str, DeviceModel] = {
    # NI 9205 Specifications: one converter for all channels, 250 kS/s: at most one conversion per 4 us
    "9205": DeviceModel(
        "",
        "NI 9205",
        inputs=AnalogInputs(
            count=32,
            ranges=(10.0, 5.0, 1.0, 0.2),
            rate=2.5e5,
            total_rate=2.5e5,
            simultaneous=False,
            wirings=_SINGLE_ENDED,
            conversion=4.0e-6,
        ),
    ),
    # NI 9215 Specifications: a successive-approximation converter for each channel
    "9215": DeviceModel(
        "",
        "NI 9215",
        inputs=AnalogInputs(4, (10.0,), 1.0e5, 1.0e5, simultaneous=True, wirings=Wirings.DIFFERENTIAL),
    ),
    # NI-9234 Specifications: 24 bits, 5 V, internal master timebase of 13.1072 MHz; the constant of its input delay is
    # the one assumed in `drivers.daqmx.delays`, since no NI document that gives it was found
    "9234": DeviceModel(
        "",
        "NI 9234",
        inputs=AnalogInputs(
            4,
            (5.0,),
            5.12e4,
            5.12e4,
            simultaneous=True,
            wirings=Wirings.PSEUDODIFFERENTIAL,
            resolution=24,
            raw_bits=32,
            delta_sigma=DeltaSigma(timebase=13.1072e6, samples=_FILTER, seconds=2.6e-6),
        ),
    ),
    # NI 9239 Operating Instructions and Specifications: 24 bits, internal master timebase of 12.8 MHz, input delay
    # (40 + 5/512) / fs + 3.3 us
    "9239": DeviceModel(
        "",
        "NI 9239",
        inputs=AnalogInputs(
            4,
            (10.0,),
            5.0e4,
            5.0e4,
            simultaneous=True,
            wirings=Wirings.DIFFERENTIAL,
            resolution=24,
            raw_bits=32,
            delta_sigma=DeltaSigma(timebase=12.8e6, samples=_FILTER, seconds=3.3e-6),
        ),
    ),
    # NI 9263 and NI 9269 Specifications: four outputs, 100 kS/s each
    "9263": DeviceModel("", "NI 9263", outputs=_outputs()),
    "9269": DeviceModel("", "NI 9269", outputs=_outputs()),
    # NI 9401 Operating Instructions and Specifications, p. 7: two ports of four lines, each with one direction
    "9401": DeviceModel("", "NI 9401", lines=8, input_lines=8, direction_group=4),
    # NI 9421 Specifications: eight inputs; NI 9485 Specifications: eight relays
    "9421": DeviceModel("", "NI 9421", input_lines=8),
    "9485": DeviceModel("", "NI 9485", lines=8),
}

_CDAQ_ENGINES = ("te0", "te1", "ai")
"""Timing engines for analogue inputs (NI-DAQmx help, "cDAQ-91xx and TestScale Chassis Timing Engines")."""
_CRIO_INPUTS = tuple(f"it{k}" for k in range(8))
_CRIO_OUTPUTS = tuple(f"ot{k}" for k in range(8))
"""Output timing engines of a DAQmx-enabled cRIO, which also has eight for inputs (NI knowledge base,
kA03q000000x3FRCAY).
"""
_CDAQ = ProductCategory.COMPACT_DAQ_CHASSIS
_CRIO = ProductCategory.COMPACT_RIO_CHASSIS
_CHASSIS_WATCHDOG = (2.0**32 - 1.0) * 25.0e-9
"""Longest time-out [s] (cDAQ-9185 User Manual, "Watchdog Timer")."""


def _cdaq(product: str, watchdog: float | None = None) -> DeviceModel:
    return DeviceModel("cDAQ1", product, _CDAQ, watchdog=watchdog, input_engines=_CDAQ_ENGINES)


def _crio(product: str) -> DeviceModel:
    """A CompactRIO controller, without a watchdog: the NI-DAQmx help lists none for CompactRIO."""
    return DeviceModel("cRIO1", product, _CRIO, input_engines=_CRIO_INPUTS, output_engines=_CRIO_OUTPUTS)


CHASSIS: dict[str, tuple[int, DeviceModel]] = {
    "cDAQ-9174": (4, _cdaq("cDAQ-9174")),
    "cDAQ-9185": (4, _cdaq("cDAQ-9185", _CHASSIS_WATCHDOG)),
    "cRIO-9045": (8, _crio("cRIO-9045")),
    "cRIO-9049": (8, _crio("cRIO-9049")),
}
"""Number of slots and device model of each chassis, keyed by product name."""


def _x_series(product: str, *, transfer_condition: bool) -> DeviceModel:
    """An NI 6351. Its multiplexed converter samples one channel at up to 1.25 MS/s, or several channels at 1 MS/s in
    total (X Series User Manual, "Analog Input", "Aggregate versus Single Channel Sample Rates").

    Its watchdog acts on digital lines only (X Series User Manual, "Digital Output", "Watchdog Timer"). It has four
    counters (X Series User Manual, "Counters").
    """
    return DeviceModel(
        "Dev1",
        product,
        ProductCategory.X_SERIES_DAQ,
        serial=0x01C06351,
        inputs=AnalogInputs(
            count=16,
            ranges=(10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1),
            rate=1.25e6,
            total_rate=1.0e6,
            simultaneous=False,
            wirings=_SINGLE_ENDED,
            conversion=1.0e-6,
        ),
        outputs=AnalogOutputs(2, (10.0, 5.0), 2.86e6, 8191, transfer_condition=transfer_condition),
        lines=8,
        input_lines=8,
        watchdog=34.0,
        counters=4,
    )


SINGLE: dict[str, DeviceModel] = {
    "PCIe-6351": _x_series("PCIe-6351", transfer_condition=True),
    # without bus mastering there is a request size instead of a transfer condition (NI-DAQmx help, "AO.UsbXferReqSize")
    "USB-6351": _x_series("USB-6351 (BNC)", transfer_condition=False),
}

NAMES = (*CHASSIS, *SINGLE)
"""Names of the devices that can be emulated."""
SUGGESTED = ("9205", "9263", "9401", "9485")
"""Default modules of a chassis: analogue inputs, analogue outputs, digital lines and relays."""


def build(device: str, modules: Sequence[str] = ()) -> tuple[DeviceModel, ...]:
    """The device; for a chassis, the chassis and its modules: `modules`, or by default `SUGGESTED`, from slot 1 on.

    Inputs 0, 1, 2, ... of every input module are wired to terminals 0, 1, 2, ... of the plant, in parallel. Raises
    InvalidInput for an unknown device or module, for too many modules, and for modules of a device without slots.
    """
    if device in SINGLE:
        if modules:
            raise InvalidInput("--modules", " ".join(modules), f"a {device} has no slots")
        return (SINGLE[device],)
    if device not in CHASSIS:
        raise InvalidInput("--device", device, f"it must be one of {', '.join(NAMES)}")
    slots, chassis = CHASSIS[device]
    chosen = tuple(modules) or SUGGESTED
    for module in chosen:
        if module not in MODULES:
            raise InvalidInput("--modules", module, f"it must be one of {', '.join(MODULES)}")
    if len(chosen) > slots:
        raise InvalidInput("--modules", " ".join(chosen), f"a {device} has {slots} slots")
    built = tuple(
        replace(
            MODULES[module],
            name=f"{chassis.name}Mod{slot}",
            category=ProductCategory.C_SERIES_MODULE,
            serial=0x01D00000 + slot,
            chassis=chassis.name,
            outputs=_on_bus(MODULES[module].outputs, chassis),
            input_engines=chassis.input_engines,
            output_engines=chassis.output_engines,
        )
        for slot, module in enumerate(chosen, 1)
    )
    return replace(chassis, serial=0x01D00000, modules=tuple(module.name for module in built)), *built


def _on_bus(outputs: AnalogOutputs | None, chassis: DeviceModel) -> AnalogOutputs | None:
    """Outputs of a module in `chassis`. Their transfer condition can be set only if the chassis is a CompactRIO
    controller, which uses bus mastering.
    """
    return None if outputs is None else replace(outputs, transfer_condition=chassis.category is _CRIO)
