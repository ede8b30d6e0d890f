"""The safety inputs of a real bench: which the program reads, and what else keeps a dead program from driving."""

from collections.abc import Iterator

from bench.analysis.check_line import CheckLine, passed, untested
from bench.config.model import BenchConfiguration

_MISSING = "the program does not read it: see that it opens the enable chain by itself"
_ALONE = "nothing opens the enable relay when the program dies: wire a heartbeat relay, or set a watchdog"


def safety_lines(configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """A line for each safety input, once the bench has been listened to; none for a simulated bench.

    An input that is open refuses the arming, and one that opens ends the check: those that are read were good.
    """
    if configuration.backend != "hardware":
        return
    daq = configuration.hardware.daq
    for name, given in daq.safety_inputs.items():
        yield passed(name, f"{given.line} was {given.good}: good")
    for name in daq.missing_inputs:
        yield untested(name, "safety input", _MISSING)
    if daq.watchdog is None and daq.heartbeat is None:
        yield untested("enable line", "heartbeat or watchdog", _ALONE)
