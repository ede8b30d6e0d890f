"""Notices about valid but unusual values, such as those outside the usual range in their declaration."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from math import tau
from typing import Any, NamedTuple

from bench.config.declared import declared
from sim.parameters import Parameters
from sim.specimen import Frame, Specimen

ANGULAR = "rad/s"
"""The unit of circular frequencies; unusual values are shown in Hz too."""

_SLOW, _FAST = 0.6, 2.5
"""Usual frequencies: from `_SLOW` times the first to `_FAST` times the second natural frequency of the bare frame."""


_SPRING_OFF = 2.0
"""Largest usual ratio of a spring stiffness to its nominal value; the smallest is the reciprocal."""


class _Watched(NamedTuple):
    name: str
    unit: str
    usual: tuple[float, float] | None


def unusual(parameters: Parameters, prefix: str = "") -> Iterator[str]:
    """A notice for each key with a value outside its usual range, naming value and range; keys begin with `prefix`.

    Zero, where allowed, causes no notice. For a list, the notice names the first unusual value and counts the others.
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
            yield f"{said} is {'below' if abs(value) < low else 'above'} the usual range, {low:.3g} to {high:.3g}{unit}"
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
                f"{said} is far {where} the modes of the bare frame, {natural} rad/s: if the value is in Hz, "
                "add the unit"
            )


def in_hertz(parameters: Parameters) -> Iterator[str]:
    """A line for each circular frequency or list of frequencies, in rad/s and Hz."""
    for watched in _watched(type(parameters))[0]:
        values = [value for _, value in _numbers("", getattr(parameters, watched.name))]
        if watched.unit == ANGULAR and values:
            angular, cycles = (" ".join(f"{value * k:.4g}" for value in values) for k in (1.0, 1.0 / tau))
            yield f"{watched.name} = {angular} rad/s = {cycles} Hz"


def notices_of(parameters: Parameters, specimen: Specimen) -> tuple[str, ...]:
    """Notices about the parameters of a protocol or prediction, with this specimen on the table."""
    found = (*unusual(parameters), *off_resonance(parameters, specimen.frame.natural_frequencies))
    # one notice per key: the later one, with the natural frequencies, is more specific
    return tuple({notice.partition(" = ")[0].partition("[")[0]: notice for notice in found}.values())


def scales_of(parameters: Parameters, specimen: Specimen) -> tuple[str, ...]:
    """Lines with the requested circular frequencies and the natural frequencies of the bare frame, in rad/s and Hz;
    empty if no circular frequency was requested.
    """
    lines = tuple(in_hertz(parameters))
    if not lines:
        return ()
    modes = " and ".join(f"{mode:.4g} rad/s = {mode / tau:.4g} Hz" for mode in specimen.frame.natural_frequencies)
    return (*lines, f"modes of the bare frame: {modes}")


def specimen_notices(specimen: Specimen, prefix: str = "specimen.") -> Iterator[str]:
    """Notices about the assumed properties of a specimen."""
    yield from unusual(specimen, prefix)
    yield from damping_notices(specimen.frame, f"{prefix}frame.")
    frame = specimen.frame
    nominal = specimen.spring_k1 or frame.k1
    if not 1.0 / _SPRING_OFF <= nominal / frame.k1 <= _SPRING_OFF:
        yield f"{prefix}spring_k1 = {nominal:g} N/m is {nominal / frame.k1:.3g} times frame.k1 = {frame.k1:g} N/m"
    for place, spring in enumerate(specimen.springs):
        ratio = spring.k_c / (spring.label * nominal)
        if not 1.0 / _SPRING_OFF <= ratio <= _SPRING_OFF:
            item, promised = f"{prefix}springs[{place}].k_c = {spring.k_c:g} N/m", spring.label * nominal
            yield f"{item} is {ratio:.3g} times {promised:.4g} N/m, the nominal value for its label {spring.label:g}"


def damping_notices(frame: Frame, prefix: str) -> Iterator[str]:
    """A notice if the damping ratios of the frame make a dashpot negative, with ratios that do not."""
    for number, dashpot in enumerate(frame.dashpots, 1):
        if dashpot < 0.0:
            # rounded inwards
            low, high = 1.001 * frame.passive_ratios[0], 0.999 * frame.passive_ratios[1]
            yield (
                f"{prefix}xi1 = {frame.xi1:g}, xi2 = {frame.xi2:g} give a dashpot c{number} = {dashpot:.3g} N s/m; a "
                f"negative dashpot adds energy: use ratios with xi2/xi1 from {low:.4g} to {high:.4g}"
            )


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
    """The numerical fields of a group with units and usual ranges, and the names of its nested groups."""
    entries = tuple(declared(model))
    numbers = tuple(_Watched(each.name, each.unit, each.usual) for each in entries if each.kind in (int, float))
    return numbers, tuple(each.name for each in entries if each.element is not None)
