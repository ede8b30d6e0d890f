"""Declarations of parameters and recorded values, with unit, limits and meaning in one place.

Validation, configuration file, command-line flags, documentation table and the data file's metadata follow from the
declaration of a parameter; a column of the data file, and its handling by reader, export and replay, follow from the
declaration of a recorded value.
"""

from collections.abc import Iterator
from dataclasses import field
from typing import Any, cast

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

NEAR, NEAR_ANGULAR = 20.0, 3.0
"""Largest factors by which a value may differ from its default without a notice: for most units, and for those in
`_ANGULAR`.

A wrong prefix changes a value by a factor of 1000, and a wrong angular unit by 2 pi. The mistake is noticed if the
intended value is within a factor of 50 or 2, respectively, of the default.
"""

COUPLING = (0.02, 5.0)
"""Usual stiffness ratios of coupling springs. The springs of the paper have 0.25 to 0.97; its maps extend to 1.2."""

_ANGULAR = ("rad/s", "Hz", "rad", "N/m")


class Parameters(BaseModel):
    """A frozen group of validated parameters in SI units; rejects unknown names and non-finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Names and values of the required fields and of those that differ from their defaults."""
        for name, declared in type(self).model_fields.items():
            value = getattr(self, name)
            if declared.is_required() or value != declared.get_default(call_default_factory=True):
                yield name, value

    def __str__(self) -> str:
        return repr(self)


def quantity(
    default: Any,
    unit: str,
    description: str,
    *,
    usual: tuple[float, float] | None = None,
    example: Any = None,
    formerly: str | None = None,
    **limits: Any,
) -> Any:
    """Declare a field of `Parameters` with its SI `unit` ("1" for a pure number) and its `limits` (gt, ge, lt, le).

    A magnitude outside `usual`, (lowest, highest) in that unit, causes a notice; see `usual_of`. A field that
    is absent by default has an `example` of valid input. `formerly` is the name of the field in earlier versions, which
    readers of files accept with a notice.
    """
    extra: dict[str, Any] = {"unit": unit}
    if usual is not None:
        extra["usual"] = list(usual)
    if example is not None:
        extra["example"] = example
    if formerly is not None:
        extra["formerly"] = formerly
    return Field(default, description=description, json_schema_extra=extra, **limits)


def column(unit: str, description: str, **options: Any) -> Any:
    """Declare a recorded field of a dataclass with its SI `unit` ("1" for a pure number, "" for a string).

    `options` are those of `dataclasses.field`.
    """
    return field(metadata={"unit": unit, "description": description}, **options)


def unit_of(field: FieldInfo) -> str:
    """SI unit that `quantity` stored in a field; empty for strings, switches and nested groups."""
    return str(_extra(field).get("unit", ""))


def usual_of(field: FieldInfo) -> tuple[float, float] | None:
    """Range of magnitudes of a field that cause no notice; None if every value is plausible.

    Without a declared range, the range of a quantity with a dimension extends to a factor of `NEAR` around its default,
    or of `NEAR_ANGULAR` where a factor of 2 pi or a value in degrees is a likely mistake.
    """
    extra = _extra(field)
    if "usual" in extra:
        low, high = cast(list[float], extra["usual"])
        return low, high
    unit = unit_of(field)
    default: Any = None if field.is_required() else field.default
    several = cast(tuple[Any, ...], default) if isinstance(default, tuple) else (default,)
    numbers = [abs(float(each)) for each in several if isinstance(each, float | int) and each != 0]
    if unit in ("", "1") or not numbers:
        return None
    factor = NEAR_ANGULAR if unit in _ANGULAR else NEAR
    return min(numbers) / factor, max(numbers) * factor


def example_of(field: FieldInfo) -> Any:
    """Example of valid input for a field that is absent by default; None for other fields."""
    return _extra(field).get("example")


def former_name_of(field: FieldInfo) -> str | None:
    """Name of a field in earlier versions; None if it has not changed."""
    return _extra(field).get("formerly")


def _extra(field: FieldInfo) -> dict[str, Any]:
    extra = cast(object, field.json_schema_extra)
    return cast(dict[str, Any], extra) if isinstance(extra, dict) else {}


def each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    """Validator that returns the `values` of a list, or raises ValueError if one occurs twice."""
    if len(set(values)) < len(values):
        raise ValueError("each value may occur only once")
    return values
