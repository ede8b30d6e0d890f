"""Notices of values that are valid but unusual: outside the usual range that their declaration states."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from math import tau
from typing import Any, NamedTuple

from bench.config.declared import declared
from sim.parameters import Parameters

ANGULAR = "rad/s"
"""The unit of circular frequencies: said in Hz too wherever one looks unusual."""

_SLOW, _FAST = 0.6, 2.5
"""Shares of the first and of the second natural frequency of the bare frame outside which a frequency is unusual."""


class _Watched(NamedTuple):
    name: str
    unit: str
    usual: tuple[float, float] | None


def unusual(parameters: Parameters, prefix: str = "") -> Iterator[str]:
    """A notice for each key with a value outside its usual range, naming both; keys begin with `prefix`.

    Zero is no slip where it is allowed. Of a list the first such value is named.
    """
    values, groups = _watched(type(parameters))
    for watched in values:
        if watched.usual is None:
            continue
        low, high = watched.usual
        numbers = _numbers(f"{prefix}{watched.name}", getattr(parameters, watched.name))
        outside = [(item, value) for item, value in numbers if value != 0.0 and not low <= abs(value) <= high]
        if outside:
            item, value = outside[0]
            unit = "" if watched.unit == "1" else f" {watched.unit}"
            said = f"{item} = {value:g}{unit}{_in_hertz(value, watched.unit)}{_others(outside)}"
            yield f"{said} lies {'below' if abs(value) < low else 'above'} the usual {low:.3g} to {high:.3g}{unit}"
    for name in groups:
        group = getattr(parameters, name)
        if isinstance(group, Parameters):
            yield from unusual(group, f"{prefix}{name}.")
        elif group:
            for place, each in enumerate(group):
                yield from unusual(each, f"{prefix}{name}[{place}].")


def off_resonance(parameters: Parameters, modes: tuple[float, float]) -> Iterator[str]:
    """A notice for each key with a circular frequency far from the `modes` of the bare frame [rad/s]."""
    for watched in _watched(type(parameters))[0]:
        if watched.unit != ANGULAR:
            continue
        numbers = _numbers(watched.name, getattr(parameters, watched.name))
        outside = [(item, value) for item, value in numbers if not _SLOW * modes[0] <= value <= _FAST * modes[1]]
        if outside:
            item, value = outside[0]
            said = f"{item} = {value:g} rad/s{_in_hertz(value, ANGULAR)}{_others(outside)}"
            where = "below" if value < modes[0] else "above"
            natural = " and ".join(f"{mode:.3g}" for mode in modes)
            yield (
                f"{said} lies far {where} the modes of the bare frame, {natural} rad/s: "
                "was Hz meant? write it with its unit"
            )


def in_hertz(parameters: Parameters) -> Iterator[str]:
    """A line for each circular frequency or list of them, in both units."""
    for watched in _watched(type(parameters))[0]:
        values = [value for _, value in _numbers("", getattr(parameters, watched.name))]
        if watched.unit == ANGULAR and values:
            angular, cycles = (" ".join(f"{value * k:.4g}" for value in values) for k in (1.0, 1.0 / tau))
            yield f"{watched.name} = {angular} rad/s = {cycles} Hz"


def _others(outside: Sequence[object]) -> str:
    return f" (and {len(outside) - 1} more)" if len(outside) > 1 else ""


def _in_hertz(value: float, unit: str) -> str:
    return f" = {value / tau:.2f} Hz" if unit == ANGULAR else ""


def _numbers(item: str, value: Any) -> Iterable[tuple[str, float]]:
    if isinstance(value, float | int):
        return [(item, float(value))]
    return [(f"{item}[{place}]", float(each)) for place, each in enumerate(value or ())]


@cache
def _watched(model: type[Parameters]) -> tuple[tuple[_Watched, ...], tuple[str, ...]]:
    """Numbers of a group with units and usual ranges, and the names of its nested groups."""
    entries = tuple(declared(model))
    numbers = tuple(_Watched(each.name, each.unit, each.usual) for each in entries if each.kind in (int, float))
    return numbers, tuple(each.name for each in entries if each.element is not None)
