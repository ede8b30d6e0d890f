"""Command-line flags from declared parameters: declared once, offered as `--name VALUE`, checked by the model."""

from collections.abc import Mapping
from inspect import Parameter as Argument
from math import isclose
from typing import Annotated, Any

from cyclopts import Group, Parameter

from bench.config.declared import Declared, declared
from bench.config.validation import read_typed
from sim.parameters import Parameters

_METAVAR: dict[Any, str] = {int: "INT", float: "NUMBER", str: "TEXT"}


def flag(name: str) -> str:
    """The flag of a parameter."""
    return "--" + name.replace("_", "-")


def arguments_of(model: type[Parameters], group: Group, positional: str | None = None) -> list[Argument]:
    """One keyword-only argument for each field of `model`; None, the default, stands for "not given".

    The field `positional`, which holds several texts, is given by place and not by flag. Values arrive as text: the
    model, not the command-line parser, decides what they may be, and says so.
    """
    fields = list(declared(model))
    placed = [_by_place(entry, group) for entry in fields if entry.name == positional]
    return [*placed, *(_argument(entry, group) for entry in fields if entry.name != positional)]


def given(model: type[Parameters], arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of `model` that were given as flags, or in the lines of a form, as plain data for its validation.

    Text that is not what the field holds is left as it is, for the validation to refuse.
    """
    return {
        entry.name: read_typed(entry, arguments[entry.name])
        for entry in declared(model)
        if arguments.get(entry.name) is not None
    }


def in_words(value: object) -> str:
    """A default as one would type it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _several(values: list[object]) -> str:
    """Values as one would type them; many that are equally spaced, as `start:stop:count`."""
    numbers = [value for value in values if isinstance(value, float)]
    if len(numbers) == len(values) > 8:
        first, last, steps = numbers[0], numbers[-1], len(numbers) - 1
        even = (first + (last - first) * k / steps for k in range(len(numbers)))
        if all(isclose(value, place) for value, place in zip(numbers, even, strict=True)):
            return f"{first:g}:{last:g}:{len(numbers)}"
    return " ".join(in_words(value) for value in values)


def _by_place(entry: Declared, group: Group) -> Argument:
    text = f"{entry.description[:1].upper()}{entry.description[1:]}"
    parameter = Parameter(name="FILE", metavar="FILE", help=text, show_default=False, group=group)
    return Argument(entry.name, Argument.VAR_POSITIONAL, annotation=Annotated[str, parameter])


def _argument(entry: Declared, group: Group) -> Argument:
    unit = "" if entry.unit in ("", "1") else f" {entry.unit}"
    defaults: list[object] = [] if entry.default is None else [*entry.default] if entry.many else [entry.default]
    default = f"{_several(defaults)}{unit}" if defaults else ""
    allowed = ", ".join(entry.choices) or (f"each {entry.limits}" if entry.many and entry.limits else entry.limits)
    text = f"{entry.description[:1].upper()}{entry.description[1:]}"
    details = [f"[{entry.unit}]" if unit else "", f"({allowed})" if allowed else ""]
    parameter = Parameter(
        name=flag(entry.name),
        help=" ".join([text, *(detail for detail in details if detail)]),
        show_default=default or False,
        metavar=None if entry.kind is bool else _METAVAR.get(entry.kind, "WORD") + ("..." if entry.many else ""),
        negative=None if entry.kind is bool else (),
        consume_multiple=entry.many,
        group=group,
    )
    kind = bool if entry.kind is bool else tuple[str, ...] if entry.many else str
    return Argument(entry.name, Argument.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, parameter])
