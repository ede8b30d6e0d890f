"""How far a run stays from everything that bounds it: margin = 1 - demand / limit."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf

from bench.preflight.bounds import Bound
from bench.preflight.forecast import Demand
from sim.errors import InvalidInput


@dataclass(frozen=True)
class Margin:
    """A demand beside its bound."""

    bound: Bound
    demand: Demand

    @property
    def margin(self) -> float | None:
        """What is left of the limit as assumed, as a share of it; None where the demand is not predicted."""
        return None if self.demand.value is None else 1.0 - self.demand.value / self.bound.limit

    @property
    def likely(self) -> float | None:
        """The same for 95 % of the specimens that the uncertainty allows."""
        return None if self.demand.likely is None else 1.0 - self.demand.likely / self.bound.limit


def margins(demands: Iterable[Demand], bounds: Mapping[str, Bound]) -> tuple[Margin, ...]:
    """Each demand beside its bound, tightest first, what is not predicted last."""
    found = [Margin(bounds[demand.quantity], demand) for demand in demands]
    return tuple(sorted(found, key=lambda each: inf if each.margin is None else each.margin))


def refusal(found: Sequence[Margin]) -> InvalidInput | None:
    """Why a run with these margins, tightest first, is refused: the limit that binds, or None."""
    binding = found[0] if found else None
    if binding is None or binding.margin is None or binding.margin >= 0.0:
        return None
    bound = binding.bound
    needs = f"{_needs(binding, binding.demand.value, binding.margin)}; {bound.remedy}"
    return InvalidInput(bound.owner, bound.limit, needs)


def warnings(found: Sequence[Margin]) -> tuple[str, ...]:
    """What would be exceeded with a specimen that the uncertainty allows, though not with the assumed one."""
    return tuple(
        f"with a specimen at the 95 % of its uncertainty {bound.owner} = {bound.limit:g} would be exceeded: "
        + _needs(each, each.demand.likely, each.likely)
        for each in found
        if each.likely is not None and each.likely < 0.0 <= (each.margin or 0.0)
        for bound in (each.bound,)
    )


def _needs(each: Margin, value: float | None, margin: float | None) -> str:
    bound = each.bound
    unit = "" if bound.unit == "1" else f" {bound.unit}"
    return f"{each.demand.where} takes {value:.4g}{unit} ({bound.name}), margin {100.0 * (margin or 0.0):.1f} %"
