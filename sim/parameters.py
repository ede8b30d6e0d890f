"""Declarations of parameters and of recorded values: once, with unit, limits and meaning.

From the declaration of a parameter come the validation, the configuration file, the command-line flags,
the documentation table and the metadata of the data file; from that of a recorded value its column in the data file,
with reader, export and replay.
"""

from dataclasses import field
from typing import Any, cast

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

NEAR, NEAR_ANGULAR = 20.0, 3.0
"""Factors around a default within which a value calls for no notice: a slip of units is 1000, one of angles 2 pi, so
that either shows while what was meant is within a factor of 50 or of 2 of the default."""

COUPLING = (0.02, 5.0)
"""Usual stiffness ratios of coupling springs: the paper has 0.25 to 0.97 and computes up to 1.2."""

_ANGULAR = ("rad/s", "Hz", "rad", "N/m")


class Parameters(BaseModel):
    """A frozen group of validated parameters in SI units; unknown names and non-finite numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def quantity(
    default: Any,
    unit: str,
    description: str,
    *,
    usual: tuple[float, float] | None = None,
    example: Any = None,
    **limits: Any,
) -> Any:
    """Declare a field of `Parameters` with its SI `unit` ("1" for a pure number) and its `limits` (gt, ge, lt, le).

    Within `usual`, lowest and highest magnitude in that unit, a value calls for no notice; see `usual_of`. A field that
    is absent by default has an `example` of what a person may give.
    """
    extra: dict[str, Any] = {"unit": unit}
    if usual is not None:
        extra["usual"] = list(usual)
    if example is not None:
        extra["example"] = example
    return Field(default, description=description, json_schema_extra=extra, **limits)


def column(unit: str, description: str, **options: Any) -> Any:
    """Declare a recorded field of a dataclass with its SI `unit` ("1" for a pure number, "" for a text).

    `options` are those of `dataclasses.field`.
    """
    return field(metadata={"unit": unit, "description": description}, **options)


def unit_of(field: FieldInfo) -> str:
    """The SI unit that `quantity` stored on a field; empty for texts, switches and nested groups."""
    return str(_extra(field).get("unit", ""))


def usual_of(field: FieldInfo) -> tuple[float, float] | None:
    """Lowest and highest magnitude of a field that call for no notice; None where every value is as good as another.

    Where none is declared: for a quantity with a dimension, what is within a factor of `NEAR` of its default, closer
    where 2 pi or degrees can slip in.
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
    """What a person may give for a field that is absent by default; None where there is nothing to give."""
    return _extra(field).get("example")


def _extra(field: FieldInfo) -> dict[str, Any]:
    extra = cast(object, field.json_schema_extra)
    return cast(dict[str, Any], extra) if isinstance(extra, dict) else {}


def each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    """The values of a list of points, when none is there twice; ValueError otherwise. For use as a validator."""
    if len(set(values)) < len(values):
        raise ValueError("each value may be asked for once")
    return values
