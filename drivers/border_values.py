"""Checks of the values that a rig returns."""

import re
from collections.abc import Mapping
from math import isfinite
from typing import Any, TypeGuard, cast

import numpy as np

from drivers.rig import Alignment, Channel, RawValues

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

RAW = ("index", "time", "code", "arrival")


def is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return isfinite(cast(float, value))
    except OverflowError:
        return False


def is_count(value: object) -> TypeGuard[int]:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def is_good(value: object) -> bool:
    """Whether a safety input is good; any value that is not a Boolean counts as open."""
    return isinstance(value, bool | np.bool_) and bool(cast(bool, value))


def is_text(value: object, *, printable: bool = False) -> bool:
    if not isinstance(value, str):
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return not printable or value.isprintable()


def is_alignment(value: Any, sensors: list[str]) -> bool:
    if not isinstance(value, Alignment) or value.sensor not in sensors:
        return False
    # offset and rate are NaN while unknown, as in a run that ends before its first block
    line = (value.offset, value.rate)
    known = all(map(is_number, line)) or all(each != each for each in line)
    return (
        known
        and (is_number(value.residual) or value.residual != value.residual)
        and is_number(value.delay)
        and all(map(is_count, (value.values, value.lost, value.late, value.implausible)))
    )


def is_raw(value: Any, sensors: list[str]) -> bool:
    if not isinstance(value, RawValues) or value.sensor not in sensors:
        return False
    columns: list[Any] = [getattr(value, name) for name in RAW]
    return all(
        type(each) is np.ndarray and each.dtype == np.int64 and each.ndim == 1 and len(each) == len(columns[0])
        for each in columns
    )


def wrong_with(channel: Any) -> str:
    """Description of the defect of a channel; empty for a valid one."""
    if not isinstance(channel, Channel):
        return f"{type(channel).__name__} is not a channel"
    if not (is_text(channel.name) and _NAME.fullmatch(channel.name)):
        return f"its name {channel.name!a} is not an identifier"
    for item, text in (("unit", channel.unit), ("quantity", channel.quantity)):
        if not is_text(text, printable=True) or not text:
            return f"the {item} of {channel.name} is {text!a}: it must be printable text"
    if not is_text(channel.device):
        return f"the device of {channel.name} is {channel.device!a}: it must be text"
    if not is_number(channel.scale) or channel.scale == 0.0:
        return f"the scale of {channel.name} is {channel.scale!a}: it must be a finite number other than 0"
    if not is_number(channel.offset):
        return f"the offset of {channel.name} is {channel.offset!a}: it must be a finite number"
    higher: Any = channel.higher
    if type(higher) is not tuple or not all(map(is_number, cast("tuple[Any, ...]", higher))):
        return f"the higher terms of {channel.name} are {higher!a}: they must be a tuple of finite numbers"
    return _counts_fault(channel)


def _counts_fault(channel: Channel) -> str:
    valid, faults, span = cast(Any, channel.valid), cast(Any, channel.faults), np.iinfo(np.int32)
    if (
        type(valid) is not tuple
        or len(cast("tuple[Any, ...]", valid)) != 2
        or not all(map(is_count, cast("tuple[Any, ...]", valid)))
        or not span.min <= valid[0] < valid[1] <= span.max
    ):
        return f"the valid counts of {channel.name} are {valid!a}: they must be two increasing 32-bit integers"
    if not isinstance(faults, Mapping) or not all(
        is_count(count) and is_text(text, printable=True) for count, text in cast("Mapping[Any, Any]", faults).items()
    ):
        return f"the faults of {channel.name} are {faults!a}: they must map counts to printable texts"
    with np.errstate(all="ignore"):
        limits = channel.limits
    return (
        ""
        if all(map(isfinite, limits))
        else f"the values of {channel.name} range from {limits[0]} to {limits[1]}: both must be finite"
    )
