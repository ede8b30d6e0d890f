"""What an experiment says of its run beforehand: its whole drive, and the most it asks of every limited quantity."""

from dataclasses import dataclass

from bench.control.legs import Leg


@dataclass(frozen=True)
class Demand:
    """The largest predicted value of one limited quantity, a key of `bench.preflight.bounds`, in its SI unit.

    `value` is for the specimen as assumed; 95 % of the specimens that its uncertainty allows stay below `likely`.
    `where` says when it occurs. Both values are None where nothing predicts them; `where` then says why.
    """

    quantity: str
    value: float | None
    likely: float | None
    where: str


@dataclass(frozen=True)
class Stage:
    """A part of the run: table motions from silence, and the estimated chance that it succeeds if one is known."""

    name: str
    legs: tuple[Leg, ...]
    chance: float | None = None


@dataclass(frozen=True)
class Forecast:
    """All that is known of a run beforehand; `duration` is its expected length [s]. Empty for an experiment that
    predicts nothing.

    `warnings` are what the operator should know although the run may begin; `notes` say what was made of the input.
    """

    demands: tuple[Demand, ...] = ()
    stages: tuple[Stage, ...] = ()
    duration: float | None = None
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
