"""Faults in the amplifier's enable chain, and of the contacts that show it."""

from collections.abc import Callable
from typing import Any

from drivers.emulation.safety_chain import SafetyChain
from tests.faults.emulated.fault import WiredFault, before, while_read
from tests.faults.fault import stays
from tests.faults.places import Place


def _does(act: Callable[[SafetyChain], None]) -> Callable[[Any], None]:
    def begin(bench: Any) -> None:
        act(bench.laboratory.safety)

    return begin


def _while_read(place: Place, bench: object) -> bool:  # noqa: ARG001 - the signature of every rule
    return while_read(place)


def _in_time(place: Place, bench: object) -> bool:  # noqa: ARG001
    """The table is still driven when the relay's time-out is over."""
    return before("armed again")(place)


def safety() -> list[WiredFault]:
    """The chain opens by itself at once; what is to be seen is that the run ends and says so."""
    name = "emergency stop|over-travel|amplifier ready"
    opening: dict[str, Callable[[SafetyChain], None]] = {
        "emergency stop pressed": SafetyChain.press_emergency_stop,
        "over-travel at one end": lambda chain: chain.trip_over_travel(1),
        "over-travel at the other end": lambda chain: chain.trip_over_travel(2),
        "wire of the emergency stop broken": lambda chain: chain.break_wire("emergency_stop"),
        "wire of an over-travel switch broken": lambda chain: chain.break_wire("over_travel"),
    }
    # the contact of the amplifier says nothing while it is not to be enabled
    enabled: dict[str, Callable[[SafetyChain], None]] = {
        "amplifier tripped": SafetyChain.trip_amplifier,
        "wire of the amplifier's contact broken": lambda chain: chain.break_wire("amplifier_ready"),
    }
    beating = WiredFault(
        "wire of the heartbeat broken",
        _does(lambda chain: chain.break_wire("heartbeat")),
        "halted|failed",
        "amplifier ready",
        _in_time,
        True,
    )
    return [
        beating,
        *(WiredFault(what, _does(act), "halted|failed", name, _while_read) for what, act in opening.items()),
        *(WiredFault(what, _does(act), "halted|failed", name, stays, True) for what, act in enabled.items()),
    ]
