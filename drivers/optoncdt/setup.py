"""The settings that a sensor is read with. They are lost when it is switched off: nothing is stored in it."""

from math import isclose

from drivers.errors import DeviceNotFound, RigError
from drivers.optoncdt.dialogue import SLOW, CommandRefused, Dialogue
from drivers.optoncdt.info import SensorInfo
from drivers.optoncdt.layout import Layout, layout_in, wanted
from sim.errors import InvalidInput

_FIXED = ("AVERAGE NONE", "TRIGGER NONE", "OUTHOLD NONE", "OUTREDUCEDEVICE NONE")
"""No filter, no trigger, no old value in the place of an error, no value left out."""


def require_sensor(name: str, who: str, info: SensorInfo, measuring_range: float) -> None:
    """Raise DeviceNotFound for another model, InvalidInput for another measuring range [m] than configured."""
    if not info.supported:
        raise DeviceNotFound(
            f"{who} is a {info.model}, whose values mean something else; connect an ILD1420, or correct the port"
        )
    if not isclose(info.measuring_range, measuring_range, rel_tol=1e-4):
        allowed = f"{who} has {info.measuring_range:g} m: correct the configuration, or the port of this laser"
        raise InvalidInput(f"hardware.{name}.measuring_range", measuring_range, allowed)


def configure(dialogue: Dialogue, rate: float, baud: int) -> Layout:
    """Set everything that a measurement at `rate` [1/s] depends on, with the output switched off.

    Raises InvalidInput for a rate that the line or the sensor does not have, RigError when the sensor refuses.
    """
    signals = wanted(rate, baud)
    dialogue.ask("ECHO OFF")
    _require_no_mastering(dialogue)
    _set_rate(dialogue, rate)
    for command in _FIXED:
        dialogue.ask(command)
    dialogue.ask(f"OUTADD_RS422 {' '.join(signals)}")
    layout = layout_in(dialogue.who, dialogue.setting("GETOUTINFO_RS422"), signals)
    dialogue.ask("LASERPOW FULL")
    return layout


def _require_no_mastering(dialogue: Dialogue) -> None:
    """A mastered distance has another zero, and nothing in the stream says so (manual, p. 65)."""
    remedy = "set MASTERMV NONE in its web interface"
    try:
        mastering = dialogue.setting("MASTERMV", SLOW)
    except CommandRefused as error:
        raise RigError(
            f"{dialogue.who} does not say whether its zero is shifted: {error.answer}; {remedy}, or use its analogue"
            " output"
        ) from error
    if mastering != ["NONE"]:
        raise RigError(f"{dialogue.who} has its zero shifted (MASTERMV {' '.join(mastering) or '?'}); {remedy}")


def _set_rate(dialogue: Dialogue, rate: float) -> None:
    """Set the rate, sent in kHz, and read it back: what was not accepted would only show as another time scale."""
    item = "hardware.lasers.rate"
    known = "sensors have 250, 500, 1000, 2000 and 4000 1/s, newer ones 8000 1/s"
    try:
        dialogue.ask(f"MEASRATE {rate / 1e3:g}")
    except CommandRefused as error:
        raise InvalidInput(item, rate, f"{dialogue.who} does not accept it ({error.answer}); {known}") from error
    answer = " ".join(dialogue.setting("MEASRATE"))
    try:
        actual = float(answer.removesuffix("KHZ")) * 1e3
    except ValueError:
        raise RigError(
            f"{dialogue.who} does not say its rate ({answer!r}); its firmware is not supported: use its analogue output"
        ) from None
    if not isclose(actual, rate, rel_tol=1e-6):
        raise InvalidInput(item, rate, f"{dialogue.who} measures at {actual:g} 1/s instead; {known}")
