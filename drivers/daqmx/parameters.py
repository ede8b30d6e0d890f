"""How a DAQ device is wired to the bench: what the configuration says of it."""

from typing import Literal

from sim.parameters import Parameters, quantity

Wiring = Literal["default", "differential", "pseudodifferential", "RSE", "NRSE"]


class AnalogInput(Parameters):
    """One analogue input: which terminal, how it is wired, and its range."""

    terminal: str = quantity("Dev1/ai0", "", "physical channel of the input")
    wiring: Wiring = quantity("default", "", "terminal configuration of the input")
    range: float = quantity(10.0, "V", "largest magnitude at the input", gt=0, le=60)


class Daq(Parameters):
    """The DAQ device: where its driver runs, the drive output, the enable line."""

    server: str | None = quantity(
        None, "", "host:port of the gRPC device server on the controller; absent: the NI-DAQmx driver of this PC"
    )
    output: str = quantity("Dev1/ao0", "", "physical channel of the drive output")
    output_range: float = quantity(10.0, "V", "largest magnitude of the drive output", gt=0, le=10)
    enable_line: str | None = quantity(
        "Dev1/port0/line0", "", "digital line of the amplifier's enable relay; absent when there is none"
    )
    start_trigger: str | None = quantity(
        None, "", "terminal of the inputs' start trigger; absent: as the input task says itself"
    )
    clock: str | None = quantity(
        None,
        "",
        "terminal of the output's sample clock; absent: that of the inputs, as the input task says itself;"
        " OnboardClock: one of its own, which only starts with the inputs",
    )
    watchdog: float | None = quantity(
        None, "s", "time-out of the device's watchdog on the enable line; absent when it has none", ge=0.1, le=30
    )
    buffer: float = quantity(10.0, "s", "length of the input buffer: how late a block may be read", ge=1.0, le=60.0)
    patience: float = quantity(2.0, "s", "how long a call may take beyond its own duration", ge=0.1, le=60)


def device_name(terminal: str) -> str:
    """The device of a physical channel or line, as it is written there; DAQmx does not tell upper from lower case."""
    return terminal.split("/")[0]
