"""Declarations of parameters and of recorded values: once, with unit, limits and meaning.

From the declaration of a parameter come the validation, the configuration file, the command-line flags,
the documentation table and the metadata of the data file; from that of a recorded value its column in the data file,
with reader, export and replay.
"""

from dataclasses import field
from typing import Any, cast

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo


class Parameters(BaseModel):
    """A frozen group of validated parameters in SI units; unknown names and non-finite numbers are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def quantity(default: Any, unit: str, description: str, **limits: Any) -> Any:
    """Declare a field of `Parameters` with its SI `unit` ("1" for a pure number) and its `limits` (gt, ge, lt, le)."""
    return Field(default, description=description, json_schema_extra={"unit": unit}, **limits)


def column(unit: str, description: str, **options: Any) -> Any:
    """Declare a recorded field of a dataclass with its SI `unit` ("1" for a pure number, "" for a text).

    `options` are those of `dataclasses.field`.
    """
    return field(metadata={"unit": unit, "description": description}, **options)


def unit_of(field: FieldInfo) -> str:
    """The SI unit that `quantity` stored on a field; empty for texts, switches and nested groups."""
    extra = cast(object, field.json_schema_extra)
    return str(cast(dict[str, object], extra).get("unit", "")) if isinstance(extra, dict) else ""


def each_once(values: tuple[float, ...]) -> tuple[float, ...]:
    """The values of a list of points, when none is there twice; ValueError otherwise. For use as a validator."""
    if len(set(values)) < len(values):
        raise ValueError("each value may be asked for once")
    return values
