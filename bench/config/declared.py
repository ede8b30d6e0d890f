"""Description of a declared parameter: meaning, unit and limits.

Configuration files, command line and error messages take the descriptions of parameters from this module, so they
agree.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from inspect import getdoc
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic.fields import FieldInfo

from sim.parameters import Parameters, example_of, former_name_of, unit_of, usual_of

_BOUNDS: dict[type, tuple[str, str]] = {
    Gt: ("gt", "above"),
    Ge: ("ge", "at least"),
    Lt: ("lt", "below"),
    Le: ("le", "at most"),
}
_SINGULAR: dict[Any, str] = {int: "a whole number", float: "a number", bool: "true or false", str: "a text"}
_PLURAL: dict[Any, str] = {int: "whole numbers", float: "numbers", bool: "switches (true or false)", str: "texts"}
_COUNT = {0: "any number of", 1: "one or more", 2: "two or more", 3: "three or more"}


@dataclass(frozen=True)
class Declared:
    """One field of a group of parameters.

    `kind` is the type of the value, or of each value if there are `many`; `constraints` are the limits of each value
    and `lengths` those of the number of values; `optional` states whether the value may be absent.
    """

    name: str
    kind: Any
    many: bool
    optional: bool
    default: Any
    unit: str
    description: str
    constraints: tuple[object, ...]
    lengths: tuple[object, ...]
    usual: tuple[float, float] | None
    """Smallest and largest usual magnitude; values outside cause a notice. See `sim.parameters.usual_of`."""
    example: Any
    """Example of valid input for a parameter that is absent by default; see `sim.parameters.example_of`."""
    formerly: str | None
    """Name of the field in earlier versions; None if it is unchanged."""

    @property
    def group(self) -> type[Parameters] | None:
        """Type of the nested group of this field; None for a value or a list."""
        return None if self.many else self.element

    @property
    def element(self) -> type[Parameters] | None:
        """Type of the nested group, or of each group in a list of groups; None for a field of plain values."""
        return self.kind if isinstance(self.kind, type) and issubclass(self.kind, Parameters) else None

    @property
    def choices(self) -> tuple[str, ...]:
        """The allowed words, or () if the value is not a choice."""
        if get_origin(self.kind) is Literal:
            return tuple(str(choice) for choice in get_args(self.kind))
        if isinstance(self.kind, type) and issubclass(self.kind, Enum):
            return tuple(str(member.value) for member in self.kind)
        return ()

    @property
    def limits(self) -> str:
        """The limits of a value, such as "above 0 and at most 60"; empty if there are none."""
        return " and ".join(
            f"{word} {_exactly(getattr(constraint, attribute))}"
            for constraint in self.constraints
            for attribute, word in [_BOUNDS[type(constraint)]]
        )

    @property
    def allowed(self) -> str:
        """Description of the valid values, such as "one or more numbers, each above 0 and at most 60"."""
        if self.group is not None:
            return "a table of keys"
        if self.choices:
            return " or ".join(f'"{choice}"' for choice in self.choices)
        if not self.many:
            return f"{_SINGULAR.get(self.kind, 'a value')} {self.limits}".rstrip()
        least = next((limit.min_length for limit in self.lengths if isinstance(limit, MinLen)), 0)
        most = next((limit.max_length for limit in self.lengths if isinstance(limit, MaxLen)), None)
        count = _COUNT.get(least, f"{least} or more") if most is None else f"{least} to {most}"
        what = f"{count} {'tables' if self.element is not None else _PLURAL.get(self.kind, 'values')}"
        return f"{what}, each {self.limits}" if self.limits else what

    @property
    def allowed_in_unit(self) -> str:
        """`allowed` with its unit, as in "a number above 0 kg"."""
        if self.unit in ("", "1"):
            return self.allowed
        return f"{self.allowed} {self.unit}" if self.limits else f"{self.allowed} [{self.unit}]"


def declared(model: type[Parameters]) -> Iterator[Declared]:
    """The fields of a group of parameters, in the order of declaration."""
    yield from _fields(model).values()


def at(model: type[Parameters], path: Sequence[str | int]) -> Declared | None:
    """The field at `path`, described as a single value if the path ends with an index; None if it does not exist."""
    found: Declared | None = None
    group: type[Parameters] | None = model
    for key in path:
        if isinstance(key, int):
            continue
        if group is None or key not in group.model_fields:
            return None
        found = _fields(group)[key]
        group = found.element
    return replace(found, many=False) if found is not None and isinstance(path[-1], int) else found


def keys(model: type[Parameters], prefix: str = "") -> Iterator[str]:
    """The dotted keys of all values, nested groups included."""
    for entry in declared(model):
        if entry.group is not None:
            yield from keys(entry.group, f"{prefix}{entry.name}.")
        else:
            yield prefix + entry.name


def flag(name: str) -> str:
    """The flag of a parameter on the command line, such as `--amplitude-factor` for `amplitude_factor`."""
    return "--" + name.replace("_", "-")


def summary(model: type[Parameters]) -> str:
    """The first line of a group's docstring."""
    return (getdoc(model) or "").split("\n", 1)[0]


def _exactly(limit: float) -> str:
    return str(limit) if isinstance(limit, int) else f"{limit:g}"


@cache
def _fields(model: type[Parameters]) -> dict[str, Declared]:
    return {name: _declared(name, field) for name, field in model.model_fields.items()}


def _declared(name: str, field: FieldInfo) -> Declared:
    kind, inner = field.annotation, tuple[object, ...]()
    optional = get_origin(kind) in (Union, UnionType) and NoneType in get_args(kind)
    if optional:
        kind = next(option for option in get_args(kind) if option is not NoneType)
    many = get_origin(kind) in (tuple, list)
    if many:
        kind = get_args(kind)[0]
    if get_origin(kind) is Annotated:
        kind, *extras = get_args(kind)
        nested = (extra.metadata if isinstance(extra, FieldInfo) else [extra] for extra in extras)
        inner = tuple(item for items in nested for item in items)
    metadata = (*field.metadata, *inner)
    return Declared(
        name=name,
        kind=kind,
        many=many,
        optional=optional,
        default=None if field.is_required() else field.get_default(call_default_factory=True, validated_data={}),
        unit=unit_of(field),
        description=field.description or "",
        constraints=tuple(item for item in metadata if type(item) in _BOUNDS),
        lengths=tuple(item for item in metadata if isinstance(item, MinLen | MaxLen)),
        usual=usual_of(field) if kind in (int, float) else None,
        example=example_of(field),
        formerly=former_name_of(field),
    )
