"""`rockbench emulate`: serves an emulated laboratory, for test runs with the real drivers."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from bench.app.cli.inputs import configuration_from
from bench.app.cli.interrupt import until_interrupted
from bench.app.cli.options import Handed, Seed
from bench.app.cli.output import print_warning
from bench.progress import silent
from sim import waiting
from sim.errors import InvalidInput
from sim.extras import require

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from drivers.emulation.laboratory import Laboratory


_LOOK = 1.0
"""Interval between two checks of the lateness of the emulation [s]."""
LARGEST_CLOCK_ERROR = 0.01
"""Largest relative error of an emulated clock; the limit for the lasers of the virtual bench is the same."""


def emulate(
    *,
    config: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Configuration from which specimen, limits and simulation are taken."),
    ] = None,
    lasers: Annotated[
        Literal["serial", "socket", "analogue"] | None,
        Parameter(
            help="Connection of the lasers; socket replaces the serial line by a network port of this computer.",
            show_default="serial; on Windows socket",
        ),
    ] = None,
    device: Annotated[
        Literal["usb", "crio", "cDAQ-9174", "cDAQ-9185", "cRIO-9045", "cRIO-9049", "PCIe-6351", "USB-6351"],
        Parameter(help="DAQ device: usb (USB-6363), crio (cRIO-9045 with NI 9239), or the name of another device."),
    ] = "usb",
    modules: Annotated[
        tuple[str, ...] | None,
        Parameter(
            metavar="MODULE",
            negative=(),
            consume_multiple=True,
            help="Modules of a chassis, in the order of its slots. Available modules: 9205, 9215, 9234, 9239, 9263, "
            "9269, 9401, 9421, 9485.",
            show_default="9205 9263 9401 9485",
        ),
    ] = None,
    sample_rate: Annotated[
        str | None,
        Parameter(
            metavar="HZ",
            help="Samples per second of the drive, the inputs and the virtual bench (at most 20000).",
            show_default="that of the simulation",
        ),
    ] = None,
    seed: Seed = None,
    lead: Annotated[
        str | None,
        Parameter(
            metavar="S",
            help="Lead of the drive [s] in the configuration of the client; a busy computer needs a longer lead.",
            show_default="as configured",
        ),
    ] = None,
    clock_error: Annotated[
        tuple[str, str, str] | None,
        Parameter(
            metavar="NUMBER",
            negative=(),
            help="Relative errors of the clocks of DAQ, laser 1 and laser 2, such as 12e-6 30e-6 -21e-6.",
        ),
    ] = None,
    write: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="File for the configuration of a client; an existing file is never overwritten.",
            show_default="standard output",
        ),
    ] = None,
    progress: Handed = silent,
) -> int:
    """Serve an emulated laboratory: the virtual bench in real time, accessed through the instruments' protocols.

    Prints the configuration of a client, or writes it with --write, then serves the laboratory until Ctrl-C. Serial
    lasers need pseudo-terminals, which exist on Linux and macOS only; use --lasers socket elsewhere.
    """
    require("ni", "rockbench emulate")
    progress("loading the program")
    given = configuration_from(config, seed)
    if given.backend != "simulated":
        raise InvalidInput(
            "backend", given.backend, 'it must be "simulated", because the emulated laboratory uses the simulated bench'
        )
    configuration = _with_lead(_at_rate(given, sample_rate), lead)
    from bench.config.review import review

    reviewed = review(configuration)
    reviewed.require()
    for notice in reviewed.notices:
        print_warning(notice)
    errors = None if clock_error is None else _ratios(clock_error)
    if write is not None and write.exists():
        raise InvalidInput("--write", str(write), "the file exists and is never overwritten; choose another name")
    from bench.app.preflight import load_bench
    from drivers.emulation.laboratory import ClockErrors, Laboratory

    load_bench(configuration, progress)
    progress("starting the emulated laboratory")
    simulation = configuration.simulation
    laboratory = Laboratory(
        simulation.bench,
        simulation.specimen or configuration.specimen,
        seed=simulation.seed,
        spring_factor=simulation.spring_factor,
        connection=lasers or ("socket" if sys.platform == "win32" else "serial"),
        device=device,
        modules=modules or (),
        clock_errors=None if errors is None else ClockErrors(*errors),
    )
    try:
        laboratory.start()
        with until_interrupted() as over:
            _write_client_configuration(configuration, laboratory, write)
            while not waiting.wait(over, _LOOK):
                _report_lateness(laboratory)
            # close while the handler is still installed, so that a second Ctrl-C does not interrupt it
            laboratory.close()
    finally:
        laboratory.close()
    _say("the laboratory is closed")
    return 0


def _ratios(typed: tuple[str, str, str]) -> list[float]:
    """Parse the relative errors of the clocks. Raises InvalidInput."""
    from bench.config.numbers import read_number

    found: list[float] = []
    for text in typed:
        allowed = f"it must be a number from -{LARGEST_CLOCK_ERROR:g} to {LARGEST_CLOCK_ERROR:g}, such as 12e-6"
        try:
            found.append(read_number(text))
        except ValueError as error:
            raise InvalidInput("--clock-error", text, str(error) or allowed) from None
        if abs(found[-1]) > LARGEST_CLOCK_ERROR:
            raise InvalidInput("--clock-error", text, allowed)
    return found


def _at_rate(configuration: "BenchConfiguration", rate: str | None) -> "BenchConfiguration":
    """The configuration with `rate` as the sample rate of its virtual bench, if given. Raises InvalidInput."""
    if rate is None:
        return configuration
    from bench.config.sections import Simulation
    from bench.config.validation import dotted, read_fields, validated
    from sim.virtual_bench import VirtualBenchParameters

    simulation = configuration.simulation.model_dump(mode="json")
    simulation["bench"] |= read_fields(VirtualBenchParameters, {"sample_rate": rate})
    changed = validated(
        Simulation, simulation, lambda path: "--sample-rate" if path[-1] == "sample_rate" else dotted(path)
    )
    return configuration.model_copy(update={"simulation": changed})


def _with_lead(configuration: "BenchConfiguration", lead: str | None) -> "BenchConfiguration":
    """The configuration with `lead` as the lead of the drive, if given. Raises InvalidInput."""
    if lead is None:
        return configuration
    from bench.config.sections import Acquisition
    from bench.config.validation import read_fields, validated

    acquisition = configuration.acquisition.model_dump(mode="json") | read_fields(Acquisition, {"lead": lead})
    changed = validated(Acquisition, acquisition, lambda _: "--lead")
    return configuration.model_copy(update={"acquisition": changed})


def _report_lateness(laboratory: "Laboratory") -> None:
    """Warn of late values, which a client would otherwise attribute to its connection."""
    for name, delay in laboratory.late().items():
        print_warning(
            f"emulated laboratory: {name} sent values {delay:.2f} s late; this computer may be busy: close other "
            "programs, or increase acquisition.lead"
        )


def _write_client_configuration(
    configuration: "BenchConfiguration", laboratory: "Laboratory", path: Path | None
) -> None:
    """Print or write the configuration of a client, and print instructions on standard error. Raises InvalidInput."""
    from bench.config.template import as_toml

    hardware = laboratory.hardware
    changed = {"backend": "hardware", "hardware": hardware}
    text = as_toml(configuration.model_copy(update=changed))
    if path is None:
        print(text, end="", flush=True)
    else:
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(text)
        except OSError as error:
            raise InvalidInput("--write", str(path), f"the file cannot be written: {error.strerror}") from None
    _say(f"DAQ at {hardware.daq.server}, {hardware.sample_rate:g} samples per second")
    for name, laser in (("laser 1", hardware.laser_1), ("laser 2", hardware.laser_2)):
        _say(f"{name} at {laser.port if hardware.lasers.connection == 'serial' else laser.terminal}")
    named = path if path is not None else "FILE, once the text above is saved as FILE"
    _say(f"in another terminal: rockbench check --config {named}")
    _say("Ctrl-C closes the laboratory")


def _say(text: str) -> None:
    print(f"emulated laboratory: {text}", file=sys.stderr, flush=True)
