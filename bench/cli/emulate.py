"""`rockbench emulate`: a laboratory without instruments, for dry runs against the real drivers."""

import signal
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from bench.cli.inputs import Seed, configuration_from
from bench.cli.interrupt import SIGNALS
from bench.cli.progress import Handed
from bench.cli.refusal import warn
from bench.progress import silent
from sim.errors import InvalidInput
from sim.extras import require

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from drivers.emulation.laboratory import Laboratory


STEP = 0.2
"""Longest wait that no signal can end [s]."""

_LEAD = 0.4
"""Lead of the configuration that is handed out [s]: client and laboratory share one computer, which may be busy."""

LARGEST_CLOCK_ERROR = 0.01
"""Of an emulated clock: as for those of the virtual bench's lasers."""


def emulate_app() -> App:
    """`rockbench emulate`."""
    app = App(name="emulate", help="Serve an emulated laboratory for dry runs on the real drivers.", version_flags=())
    app.default(emulate)
    return app


def emulate(
    *,
    config: Annotated[
        Path | None, Parameter(metavar="FILE", help="Configuration whose specimen, limits and simulation are taken.")
    ] = None,
    lasers: Annotated[Literal["serial", "analogue"], Parameter(help="How the lasers are connected.")] = "serial",
    device: Annotated[Literal["usb", "crio"], Parameter(help="Which DAQ device there is.")] = "usb",
    sample_rate: Annotated[
        str | None,
        Parameter(
            metavar="HZ",
            help="Samples per second of drive, inputs and virtual bench (at most 20000).",
            show_default="as the simulation's",
        ),
    ] = None,
    seed: Seed = None,
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
            metavar="FILE", help="File for the configuration; never overwritten.", show_default="standard output"
        ),
    ] = None,
    progress: Handed = silent,
) -> int:
    """Serve an emulated laboratory: the virtual bench in real time behind the instruments' real protocols.

    A configuration with which a bench reaches it is printed, or written with --write; then the laboratory serves until
    Ctrl-C. Pseudo-terminals, which serial lasers need, exist on Linux and macOS only.
    """
    require("ni", "rockbench emulate")
    progress("loading the program")
    given = configuration_from(config, seed)
    if given.backend != "simulated":
        raise InvalidInput("backend", given.backend, "an emulated laboratory is made of a simulated bench")
    configuration = _at_rate(given, sample_rate)
    from bench.config.review import review

    reviewed = review(configuration)
    reviewed.require()
    for notice in reviewed.notices:
        warn(notice)
    errors = None if clock_error is None else _ratios(clock_error)
    if write is not None and write.exists():
        raise InvalidInput("--write", str(write), "it exists and is never overwritten; name another")
    from bench.preflight.compiled import load_bench
    from drivers.emulation.laboratory import ClockErrors, Laboratory

    load_bench(configuration, progress)
    progress("starting the emulated laboratory")
    simulation = configuration.simulation
    laboratory = Laboratory(
        simulation.bench,
        simulation.specimen or configuration.specimen,
        seed=simulation.seed,
        spring_factor=simulation.spring_factor,
        connection=lasers,
        device=device,
        clock_errors=None if errors is None else ClockErrors(*errors),
    )
    try:
        laboratory.start()
        with _until_asked() as over:
            _hand_out(configuration, laboratory, write)
            # in steps: on Windows, before Python 3.14, no signal ends a wait
            while not over.wait(STEP):
                pass
            # under the same handler: a second Ctrl-C must not break it
            laboratory.close()
    finally:
        laboratory.close()
    _say("the laboratory is closed")
    return 0


def _ratios(typed: tuple[str, str, str]) -> list[float]:
    """Relative errors of clocks as they were typed. Raises InvalidInput."""
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
    """The configuration with the sample rate of its virtual bench replaced. Raises InvalidInput."""
    if rate is None:
        return configuration
    from bench.cli.flags import given
    from bench.config.model import Simulation
    from bench.config.validation import dotted, validated
    from sim.virtual_bench import VirtualBenchParameters

    simulation = configuration.simulation.model_dump(mode="json")
    simulation["bench"] |= given(VirtualBenchParameters, {"sample_rate": rate})
    changed = validated(
        Simulation, simulation, lambda path: "--sample-rate" if path[-1] == "sample_rate" else dotted(path)
    )
    return configuration.model_copy(update={"simulation": changed})


def _hand_out(configuration: "BenchConfiguration", laboratory: "Laboratory", path: Path | None) -> None:
    """Give out the configuration of a client, and say on standard error how to use it. Raises InvalidInput."""
    from bench.config.dump import as_toml

    hardware = laboratory.hardware
    acquisition = configuration.acquisition.model_copy(update={"lead": max(_LEAD, configuration.acquisition.lead)})
    changed = {"backend": "hardware", "hardware": hardware, "acquisition": acquisition}
    text = as_toml(configuration.model_copy(update=changed))
    if path is None:
        print(text, end="", flush=True)
    else:
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(text)
        except OSError as error:
            raise InvalidInput("--write", str(path), f"it cannot be written: {error.strerror}") from None
    _say(f"DAQ at {hardware.daq.server}, {hardware.sample_rate:g} samples per second")
    for name, laser in (("laser 1", hardware.laser_1), ("laser 2", hardware.laser_2)):
        _say(f"{name} at {laser.port if hardware.lasers.connection == 'serial' else laser.terminal}")
    named = path if path is not None else "FILE, with the text above in FILE"
    _say(f"in another terminal: rockbench check --config {named}")
    _say("Ctrl-C closes the laboratory")


@contextmanager
def _until_asked() -> Generator[threading.Event]:
    """An event that Ctrl-C, SIGTERM and a closed terminal set, in place of what they do otherwise."""
    over = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        over.set()

    before = {number: signal.signal(number, handle) for number in SIGNALS}
    try:
        yield over
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _say(text: str) -> None:
    print(f"emulated laboratory: {text}", file=sys.stderr, flush=True)
