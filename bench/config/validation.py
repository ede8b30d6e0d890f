"""Validation of values from outside the program, with a one-line message for each error."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from json import dumps
from math import inf
from typing import Any, TypeVar, cast

from pydantic import ValidationError

from bench.config.declared import Declared, at, declared, keys
from bench.config.numbers import carries_unit, items_of, read_number, read_values, require_units_alike
from sim.errors import InvalidInput, as_text
from sim.parameters import Parameters

Path = tuple[str | int, ...]
"""Path of a value: keys and indices into lists."""

P = TypeVar("P", bound=Parameters)

_NUMBERS = (int, float)


def dotted(path: Path) -> str:
    """A path as text: `specimen.frame.k1`, `omega[2]`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".")


def validated(model: type[P], data: Mapping[str, Any], named: Callable[[Path], str] = dotted) -> P:
    """An instance of `model` from plain data, such as that of a file; `named` formats the location of a value for the
    user.

    Raises InvalidInput for the first invalid value, with the names of the others.
    """
    try:
        return _parsed(model, data)
    except ValidationError as error:
        first, *more = _refusals(model, error, named)
    also = ", ".join(dict.fromkeys(refusal.item for refusal in more if refusal.item != first.item))
    if also:
        raise InvalidInput(first.item, first.value, f"{first.allowed} (also refused: {also})")
    raise first


def problems(
    model: type[Parameters], data: Mapping[str, Any], named: Callable[[Path], str] = dotted
) -> list[InvalidInput]:
    """The error of each invalid value in `data`; empty if all values are valid."""
    try:
        _parsed(model, data)
    except ValidationError as error:
        return _refusals(model, error, named)
    return []


def former_names(model: type[Parameters], data: Mapping[str, Any], parent: Path = ()) -> Iterator[tuple[Path, str]]:
    """The keys of `data` that have the name of an earlier version, which `validated` accepts, with their current
    names.
    """
    for entry in declared(model):
        if entry.formerly in data and entry.name not in data:
            yield (*parent, str(entry.formerly)), dotted((*parent, entry.name))
        value = data.get(entry.name, data.get(str(entry.formerly)))
        if entry.element is not None and isinstance(value, dict):
            yield from former_names(entry.element, cast(dict[str, Any], value), (*parent, entry.name))


def with_present_names(model: type[Parameters], data: Mapping[str, Any]) -> dict[str, Any]:
    """The data of a file, with former names of keys replaced by the current ones. A key given under both its former and
    its current name keeps both, and validation then refuses it.
    """
    found = dict(data)
    for entry in declared(model):
        old = entry.formerly
        if old is not None and old in found and entry.name not in found:
            found[entry.name] = found.pop(old)
        value = found.get(entry.name)
        if entry.element is not None and isinstance(value, dict):
            found[entry.name] = with_present_names(entry.element, cast(dict[str, Any], value))
        elif entry.element is not None and isinstance(value, list):
            found[entry.name] = [
                with_present_names(entry.element, cast(dict[str, Any], each)) if isinstance(each, dict) else each
                for each in cast(list[Any], value)
            ]
    return found


def read_typed(entry: Declared, typed: Any) -> Any:
    """Plain data from typed text or the tokens of a list, with numbers for numeric fields.

    Invalid text is returned unchanged; validation rejects it.
    """
    if entry.kind not in _NUMBERS or isinstance(typed, bool):
        return typed
    if not entry.many:
        return _number_or_text(entry, typed) if isinstance(typed, str) else typed
    items = items_of([typed] if isinstance(typed, str) else [str(token) for token in typed])
    try:
        require_units_alike(items)
    except ValueError:
        return " ".join(items)
    return [value for item in items for value in _values_or_text(entry, item)]


def read_fields(model: type[Parameters], typed: Mapping[str, Any]) -> dict[str, Any]:
    """The typed fields of `model`, from flags or a form, as plain data for `validated`; a field that is None was not
    specified.
    """
    return {
        entry.name: read_typed(entry, typed[entry.name])
        for entry in declared(model)
        if typed.get(entry.name) is not None
    }


def _parsed(model: type[P], data: Mapping[str, Any]) -> P:
    # strict JSON validation: it accepts a list for a tuple and a word for a choice, but not "12" or true for a number
    present = _in_si(model, with_present_names(model, data))
    return model.model_validate_json(dumps(present, default=as_text), strict=True)


def _in_si(model: type[Parameters], data: Mapping[str, Any]) -> dict[str, Any]:
    """The data of a file, in which strings with units, lists or ranges have been converted to numbers."""
    found = dict(data)
    for entry in declared(model):
        value = found.get(entry.name)
        if entry.element is not None:
            if isinstance(value, dict):
                found[entry.name] = _in_si(entry.element, cast(dict[str, Any], value))
            elif isinstance(value, list):
                found[entry.name] = [
                    _in_si(entry.element, cast(dict[str, Any], each)) if isinstance(each, dict) else each
                    for each in cast(list[Any], value)
                ]
        elif entry.kind in _NUMBERS:
            if isinstance(value, str) and (entry.many or carries_unit(value)):
                found[entry.name] = read_typed(entry, value)
            elif isinstance(value, list):
                found[entry.name] = [
                    number
                    for each in cast(list[Any], value)
                    for number in (_values_or_text(entry, each) if isinstance(each, str) else [each])
                ]
    return found


def _number_or_text(entry: Declared, text: str) -> Any:
    try:
        return read_number(text, entry.unit, whole=entry.kind is int)
    except ValueError:
        return text


def _values_or_text(entry: Declared, text: str) -> Sequence[Any]:
    try:
        return read_values(text, entry.unit, whole=entry.kind is int)
    except ValueError:
        return [text]


def _remedy(entry: Declared, text: str, listed: bool) -> str:
    """Remedy for text that is not a valid number; empty if there is none."""
    try:
        if listed:
            items = items_of([text])
            require_units_alike(items)
            for item in items:
                read_values(item, entry.unit, whole=entry.kind is int)
        else:
            read_number(text, entry.unit, whole=entry.kind is int)
    except ValueError as error:
        return str(error)
    return ""


def _refusals(model: type[Parameters], error: ValidationError, named: Callable[[Path], str]) -> list[InvalidInput]:
    details = error.errors(include_url=False)
    paths = [detail["loc"] for detail in details]
    # a list with an invalid value is also reported as too short: one message suffices
    inner = [not any(other[: len(path)] == path and other != path for other in paths) for path in paths]
    return [_refusal(model, detail, named) for detail, most in zip(details, inner, strict=True) if most]


def _refusal(model: type[Parameters], detail: Any, named: Callable[[Path], str]) -> InvalidInput:
    path: Path = detail["loc"]
    value = "a table" if isinstance(detail["input"], dict) else detail["input"]
    raised = detail.get("ctx", {}).get("error")
    if isinstance(raised, InvalidInput):
        return InvalidInput(named((*path, raised.item)), raised.value, raised.allowed)
    if raised is not None:
        return InvalidInput(named(path) or "parameters", value, str(raised))
    if detail["type"] == "extra_forbidden":
        return InvalidInput(named(path), value, f"there is no such key{_suggestion(model, path)}")
    if detail["type"] == "missing":
        return InvalidInput(named(path), None, "it is required")
    entry = at(model, path)
    if entry is not None and entry.kind in _NUMBERS and isinstance(value, str):
        listed = entry.many or isinstance(path[-1], int)
        if remedy := _remedy(entry, value, listed):
            return InvalidInput(named(path), value, remedy)
    allowed = (
        f"it must be {entry.allowed_in_unit}{_unit_hint(entry, value)}" if entry is not None else str(detail["msg"])
    )
    return InvalidInput(named(path), value, allowed)


def _unit_hint(entry: Declared, value: Any) -> str:
    """Hint for a number above its limit that may be a percentage or an angle in degrees."""
    if not isinstance(value, float | int) or entry.kind is not float or not 1.0 < value <= 360.0:
        return ""
    if entry.unit == "rad":
        return f'; for {value:g} degrees write "{value:g} deg"'
    highest = min((getattr(limit, "lt", getattr(limit, "le", inf)) for limit in entry.constraints), default=inf)
    return f"; {value:g} % is {value / 100.0:g}" if entry.unit == "1" and highest <= 1.0 and value <= 100.0 else ""


def _suggestion(model: type[Parameters], path: Path) -> str:
    """Hint with the most similar known key, at the same level or anywhere, or else with the valid keys."""
    parent, name = path[:-1], str(path[-1])
    entry = at(model, parent)
    group = model if not parent else entry.group if entry is not None else None
    siblings = [field.name for field in declared(group)] if group is not None else []
    close = get_close_matches(name, siblings, n=1)
    if close:
        return f"; the nearest is {dotted((*parent, close[0]))}"
    everywhere = list(keys(model))
    elsewhere = [key for key in everywhere if key.rpartition(".")[2] == name] or get_close_matches(
        # a high cutoff, because all paths of a group are similar
        dotted(path),
        everywhere,
        n=1,
        cutoff=0.8,
    )
    if elsewhere:
        return f"; the nearest is {elsewhere[0]}"
    return f"; the valid keys here are {', '.join(siblings)}" if siblings else ""
