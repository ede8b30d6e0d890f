"""Parameters of a DAQ device: wiring, drive output and safety inputs."""

from typing import Literal

from pydantic import field_validator, model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

AUTOMATIC = "automatic"
"""Value of `laser_marker` with which the program chooses the counter."""
Wiring = Literal["default", "differential", "pseudodifferential", "RSE", "NRSE"]


class AnalogInput(Parameters):
    """One analogue input: terminal, wiring and range."""

    terminal: str = quantity("Dev1/ai0", "", "physical channel of the input")
    wiring: Wiring = quantity("default", "", "terminal configuration of the input")
    range: float = quantity(10.0, "V", "largest magnitude of the voltage at the input", gt=0, le=60, usual=(1.0, 60.0))

    @field_validator("terminal")
    @classmethod
    def _without_slash(cls, terminal: str) -> str:
        # NI MAX shows terminals with a leading slash; the names of a device's channels have none
        return terminal.strip("/")


class SafetyInput(Parameters):
    """Safety contact read by the program: digital input line, and level in the good state."""

    line: str = quantity("Dev1/port0/line1", "", "digital input line")
    good: Literal["high", "low"] = quantity(
        "high",
        "",
        "level of the line in the good state: the level that a broken wire cannot produce, high on pulled-down inputs",
    )


class EmergencyStop(SafetyInput):
    """Second contact of the emergency stop, read by the program; the first contact opens the enable chain."""


class OverTravel(SafetyInput):
    """Contact of the over-travel switches at both ends, or at one end if over_travel_2 is set."""

    line: str = quantity("Dev1/port0/line2", "", "digital input line")


class OverTravel2(SafetyInput):
    """Contact of the over-travel switch at the other end, if it has a separate line."""

    line: str = quantity("Dev1/port0/line3", "", "digital input line")


class AmplifierReady(SafetyInput):
    """Contact with which the amplifier signals that it is ready or free of faults."""

    line: str = quantity("Dev1/port0/line4", "", "digital input line")
    delay: float | None = quantity(
        None,
        "s",
        "longest time from closing the enable line to the ready signal, for an amplifier that is ready only while "
        "enabled; absent for an amplifier that is ready before it is enabled",
        gt=0,
        le=10,
        usual=(0.02, 5.0),
        example=1.0,
    )


class Heartbeat(Parameters):
    """Line that toggles once per block, for a relay in the enable chain that opens when toggling stops."""

    line: str = quantity("Dev1/port0/line5", "", "digital output line")
    timeout: float = quantity(1.0, "s", "time from the last rising edge to the opening of the relay", ge=0.1, le=10)


class Tls(Parameters):
    """Encrypted connection to the gRPC device server, whose server_config.json names the server's certificates."""

    root_certificate: str = quantity(
        "server_self_signed_crt.pem",
        "",
        "PEM file of the server's certificate, or of the authority that signed it, relative to this file",
        min_length=1,
    )
    client_certificate: str | None = quantity(
        None,
        "",
        "PEM file of the client's certificate, relative to this file; absent if the server requires none",
        example="client_self_signed_crt.pem",
    )
    client_key: str | None = quantity(
        None,
        "",
        "PEM file of the private key of that certificate, relative to this file",
        example="client_privatekey.pem",
    )
    server_name: str | None = quantity(
        None,
        "",
        "host name in the server's certificate, if it differs from that in the server's address",
        example="crio.local",
    )


class Daq(Parameters):
    """The DAQ device: location of its driver, drive output, enable line and safety inputs."""

    server: str | None = quantity(
        None,
        "",
        "host:port of the gRPC device server on the controller; if absent, the NI-DAQmx driver of this PC is used",
        example="crio.local:31763",
    )
    tls: Tls | None = quantity(
        None, "", "encryption of the connection to that server; if absent, the connection is plain"
    )
    plain_connection: bool = quantity(
        False,
        "",
        "whether an unencrypted connection to a server outside this computer and private networks is permitted",
    )
    output: str = quantity("Dev1/ao0", "", "physical channel of the drive output")
    output_range: float = quantity(10.0, "V", "largest magnitude of the drive output", gt=0, le=10, usual=(1.0, 10.0))
    enable_line: str | None = quantity(
        "Dev1/port0/line0", "", "digital line of the amplifier's enable relay; absent if there is no relay"
    )
    start_trigger: str | None = quantity(
        None,
        "",
        "terminal of the inputs' start trigger; if absent, the terminal of the input task",
        example="/Dev1/ai/StartTrigger",
    )
    clock: str | None = quantity(
        None,
        "",
        "terminal of the output's sample clock; if absent, the terminal of the input task; OnboardClock: the "
        "output's own clock, started together with the inputs",
        example="OnboardClock",
    )
    watchdog: float | None = quantity(
        None,
        "s",
        "time-out of the device's watchdog on the enable line; if absent, no watchdog is used",
        ge=0.1,
        le=30,
        usual=(0.2, 5.0),
        example=1.0,
    )
    laser_marker: str | None = quantity(
        None,
        "",
        "counter output whose short pulses at the beginning of each run and between the runs switch both serial lasers "
        "off, which aligns their clocks; automatic: the first counter of the output's device, if the lasers respond to "
        "its pulses; if absent, the clocks are aligned from the arrival times of the values",
        example="Dev1/ctr0",
    )
    emergency_stop: EmergencyStop | None = quantity(None, "", "contact of the emergency stop; absent if not wired")
    over_travel: OverTravel | None = quantity(None, "", "contact of the over-travel switches; absent if not wired")
    over_travel_2: OverTravel2 | None = quantity(
        None,
        "",
        "contact of the over-travel switch at the other end; absent if over_travel covers both ends, or if not wired",
    )
    amplifier_ready: AmplifierReady | None = quantity(None, "", "ready contact of the amplifier; absent if not wired")
    heartbeat: Heartbeat | None = quantity(None, "", "heartbeat; absent if there is no heartbeat relay")
    buffer: float = quantity(
        10.0, "s", "capacity of the input buffer as a duration: the longest possible delay of a read", ge=1.0, le=60.0
    )
    timeout_margin: float = quantity(
        2.0, "s", "time allowed for a call to the driver beyond its usual duration", ge=0.1, le=60, formerly="patience"
    )

    @property
    def safety_inputs(self) -> dict[str, SafetyInput]:
        """The wired safety inputs by interlock name."""
        return {name: given for name, given in self._possible_inputs.items() if given is not None}

    @property
    def missing_inputs(self) -> tuple[str, ...]:
        """The names of the safety inputs that are not wired, except over-travel 2, which over-travel may include."""
        given = self.safety_inputs
        return tuple(name for name in self._possible_inputs if name not in given and name != "over-travel 2")

    @property
    def digital_lines(self) -> dict[str, str]:
        """Every digital line in use, by its key."""
        inputs = {f"{name.replace('-', '_').replace(' ', '_')}.line": g.line for name, g in self.safety_inputs.items()}
        outputs = {} if self.enable_line is None else {"enable_line": self.enable_line}
        return {**outputs, **inputs, **({} if self.heartbeat is None else {"heartbeat.line": self.heartbeat.line})}

    @property
    def _possible_inputs(self) -> dict[str, SafetyInput | None]:
        return {
            "emergency stop": self.emergency_stop,
            "over-travel": self.over_travel,
            "over-travel 2": self.over_travel_2,
            "amplifier ready": self.amplifier_ready,
        }

    @model_validator(mode="after")
    def _check_lines_unique(self) -> "Daq":
        seen: dict[str, str] = {}
        for item, line in self.digital_lines.items():
            if (other := seen.setdefault(line.strip("/").lower(), item)) != item:
                raise InvalidInput(item, line, f"{other} already uses this line; each needs a separate line")
        return self

    @model_validator(mode="after")
    def _check_safety_inputs(self) -> "Daq":
        if self.heartbeat is not None and self.enable_line is None:
            raise InvalidInput("heartbeat.line", self.heartbeat.line, "it requires enable_line")
        return self


def device_name(terminal: str) -> str:
    """The device name in a physical channel or line, in its original case; DAQmx ignores case."""
    return terminal.strip("/").split("/")[0]
