"""Forecast of a run, its drive and demands, and the margins to its limits: margin = 1 - demand / limit."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment
from bench.datafile.tables import Column, Table
from bench.guard.motion import WATCHED
from sim.channel import STOREYS
from sim.errors import InvalidInput


@dataclass(frozen=True)
class Demand:
    """Largest predicted value of one limited quantity, a key of `bounds`, in its SI unit.

    `value` is for the nominal specimen. `likely` is the value that 95 % of the specimens do not exceed, given the
    uncertainty of the specimen. `where` is the part of the run in which the value occurs. If it is not predicted, both
    values are None and `where` is the reason.
    """

    quantity: str
    value: float | None
    likely: float | None
    where: str


@dataclass(frozen=True)
class Stage:
    """Part of a run: the segments of the table motion from rest, and the estimated probability of success, if known."""

    name: str
    segments: tuple[Segment, ...]
    chance: float | None = None


@dataclass(frozen=True)
class Forecast:
    """Forecast of a run; empty if its protocol predicts nothing. `duration` is the expected duration [s].

    `warnings` do not prevent the run. `notes` describe the processing of the input.
    """

    demands: tuple[Demand, ...] = ()
    stages: tuple[Stage, ...] = ()
    duration: float | None = None
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


_LESS = "reduce the acceleration"
_FASTER = f"{_LESS}, or use higher frequencies"
_AWAY = f"{_LESS}, or choose frequencies farther from the specimen's resonances"


@dataclass(frozen=True)
class Bound:
    """`limit` of one quantity in its SI `unit`, the `owner` (key or part) that sets it, and the `remedy` if it is
    exceeded.
    """

    quantity: str
    name: str
    unit: str
    limit: float
    owner: str
    remedy: str

    @property
    def suffix(self) -> str:
        """The unit as printed after a number; empty for a pure number."""
        return "" if self.unit == "1" else f" {self.unit}"


def bounds(configuration: BenchConfiguration) -> dict[str, Bound]:
    """Bound of each quantity, by key; the lowest where several apply."""
    limits = configuration.limits

    def guarded(quantity: str) -> tuple[float, str]:
        return float(getattr(limits, quantity)), f"limits.{quantity}"

    laser = min(guarded("laser_range"), (1.0, "the laser's range"))
    found = {
        "drive_voltage": ("drive", "V", min([guarded("drive_voltage"), *_drive(configuration)]), _FASTER),
        "drive_slew": ("slew of the drive", "V/s", guarded("drive_slew"), f"{_LESS}, or use lower frequencies"),
        "displacement": (*WATCHED["displacement"], min(guarded("displacement"), _stroke(configuration)), _FASTER),
        "velocity": (*WATCHED["velocity"], guarded("velocity"), _FASTER),
        "acceleration": (*WATCHED["acceleration"], guarded("acceleration"), _LESS),
        "force": (*WATCHED["force"], guarded("force"), _LESS),
        "current": (*WATCHED["current"], min([guarded("current"), *_current(configuration)]), _LESS),
        "heating": (*WATCHED["heating"], guarded("heating"), _LESS),
        **{
            name: (f"fraction of laser {number}'s half range", "1", laser, _AWAY)
            for number, name in enumerate(STOREYS, start=1)
        },
        "drift": (*WATCHED["drift"], guarded("drift"), _AWAY),
    }
    return {key: Bound(key, name, unit, *least, remedy) for key, (name, unit, least, remedy) in found.items()}


def _stroke(configuration: BenchConfiguration) -> tuple[float, str]:
    return configuration.half_stroke, "the shaker's stroke"


def _drive(configuration: BenchConfiguration) -> list[tuple[float, str]]:
    if configuration.backend != "simulated":
        key = "hardware.daq.output_range" if configuration.backend == "hardware" else "rig.drive_range"
        return [(configuration.settings.drive_range, key)]
    shaker = configuration.simulation.bench.shaker
    supply = "voltage_limit" if shaker.amplifier == "voltage" else "current_limit"
    largest = float(getattr(shaker, supply)) / shaker.gain
    return [(shaker.drive_range, "the shaker's drive_range"), (largest, f"the amplifier's {supply}")]


def _current(configuration: BenchConfiguration) -> list[tuple[float, str]]:
    if configuration.backend != "simulated":
        return []
    return [(configuration.simulation.bench.shaker.current_limit, "the amplifier's current_limit")]


@dataclass(frozen=True)
class Margin:
    """Demand and bound of one quantity, with the margins between them."""

    bound: Bound
    demand: Demand

    @property
    def margin(self) -> float | None:
        """Margin for the nominal specimen; None if the demand is not predicted."""
        return None if self.demand.value is None else 1.0 - self.demand.value / self.bound.limit

    @property
    def likely(self) -> float | None:
        """Margin that 95 % of the specimens reach or exceed, given the uncertainty; None if it is not predicted."""
        return None if self.demand.likely is None else 1.0 - self.demand.likely / self.bound.limit

    @property
    def excess(self) -> str:
        """Predicted demand and the limit that it exceeds, as text."""
        bound = self.bound
        return f"{bound.name} {self.demand.value:.4g}{bound.suffix}, {bound.owner} = {bound.limit:g}{bound.suffix}"


def margins(demands: Iterable[Demand], bounds: Mapping[str, Bound]) -> tuple[Margin, ...]:
    """Margin of each demand, in ascending order; demands that are not predicted are last."""
    found = [Margin(bounds[demand.quantity], demand) for demand in demands]
    return tuple(sorted(found, key=lambda each: inf if each.margin is None else each.margin))


def refusal(found: Sequence[Margin]) -> InvalidInput | None:
    """Error naming the exceeded limit with the smallest margin, or None. `found` is sorted by ascending margin."""
    binding = found[0] if found else None
    if binding is None or binding.margin is None or binding.margin >= 0.0:
        return None
    bound = binding.bound
    needs = f"{_needs(binding, binding.demand.value, binding.margin)}; {bound.remedy}"
    return InvalidInput(bound.owner, bound.limit, needs)


def warnings(found: Sequence[Margin]) -> tuple[str, ...]:
    """Warnings about limits that the nominal specimen does not exceed but a specimen within the uncertainty may."""
    return tuple(
        f"at the 95 % bound of the specimen's uncertainty, {bound.owner} = {bound.limit:g} would be exceeded: "
        + _needs(each, each.demand.likely, each.likely)
        for each in found
        if each.likely is not None and each.likely < 0.0 <= (each.margin or 0.0)
        for bound in (each.bound,)
    )


def _needs(each: Margin, value: float | None, margin: float | None) -> str:
    bound = each.bound
    return f"{each.demand.where} needs {value:.4g}{bound.suffix} ({bound.name}), margin {100.0 * (margin or 0.0):.1f} %"


def margins_table(margins: Sequence[Margin]) -> Table:
    """Table with one row for each limited quantity, in ascending order of margin."""

    def numbers(values: list[float | None], unit: str, description: str) -> Column:
        return Column(np.array([nan if value is None else value for value in values]), unit, description)

    def texts(values: list[str], description: str) -> Column:
        return Column(np.array(values, dtype=np.str_), "", description)

    assumed, likely = "for the nominal specimen", "that 95 % of the specimens stay below, given the uncertainty"
    return {
        "quantity": texts([each.bound.name for each in margins], "limited quantity"),
        "margin": numbers(
            [each.margin for each in margins], "1", f"1 - demand / limit, {assumed}; NaN if not predicted"
        ),
        "margin_95": numbers([each.likely for each in margins], "1", f"1 - demand / limit, for a demand {likely}"),
        "demand": numbers([each.demand.value for each in margins], "SI", f"largest predicted value {assumed}"),
        "demand_95": numbers([each.demand.likely for each in margins], "SI", f"largest predicted value {likely}"),
        "limit": numbers([each.bound.limit for each in margins], "SI", "largest allowed value"),
        "unit": texts([each.bound.unit for each in margins], "unit of demands and limit in this row"),
        "owner": texts([each.bound.owner for each in margins], "source of the limit"),
        "where": texts(
            [each.demand.where for each in margins],
            "part of the run in which the demand occurs, or the reason why it is not predicted",
        ),
    }


def drive_table(stages: Sequence[Stage]) -> Table:
    """Table with one row for each segment of the planned drive; every stage starts at zero drive."""
    rows = [(stage, segment) for stage in stages for segment in stage.segments]
    chances = [nan if stage.chance is None else stage.chance for stage, _ in rows]
    return {
        "stage": Column(np.array([stage.name for stage, _ in rows], dtype=np.str_), "", "part of the run"),
        "chance": Column(
            np.array(chances), "1", "estimated probability that the start succeeds; NaN for a stage that is not a start"
        ),
        "duration": Column(np.array([segment.duration for _, segment in rows]), "s", "duration of the segment"),
        "amplitude": Column(
            np.array([segment.amplitude for _, segment in rows]), "m/s2", "table acceleration at the end of the segment"
        ),
        "omega": Column(
            np.array([segment.omega for _, segment in rows]), "rad/s", "circular frequency at the end of the segment"
        ),
    }
