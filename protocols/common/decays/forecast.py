"""What a test of free vibration will ask of the bench: one pulse, again and again, or nothing where a hand lets go."""

from bench.config.model import BenchConfiguration
from bench.preflight.asked import UNKNOWN_SHAKER
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from protocols.common.decays.pulse import Planned

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: the probes find out, within limits.drive_voltage",
    "drive_slew": "nothing is known of this table: the probes find out, within limits.drive_slew",
    **UNKNOWN_SHAKER,
}


def pulse_forecast(configuration: BenchConfiguration, plans: dict[str, Planned], duration: float) -> Forecast:
    """The most that any of the pulses asks for; `plans` by what stands on the table."""
    demands: list[Demand] = []
    for quantity in bounds(configuration):
        known = {name: plan.asked[quantity] for name, plan in plans.items() if quantity in plan.asked}
        if not known:
            demands.append(Demand(quantity, None, None, _UNKNOWN[quantity]))
            continue
        name = max(known, key=lambda each: known[each])
        where = f"the pulse of {plans[name].pulse.duration:.2g} s, {name}"
        demands.append(Demand(quantity, known[name], None, where))
    return Forecast(demands=tuple(demands), duration=duration)


def hand_forecast(configuration: BenchConfiguration, pull: float, duration: float) -> Forecast:
    """The storeys swing as far as storey 2 is pulled, to either side of their middle; nothing is driven."""
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    known = {"laser_1": 2.0 * pull / halves[0], "laser_2": 2.0 * pull / halves[1], "drift": 2.0 * pull}
    return Forecast(
        demands=tuple(
            Demand(quantity, known.get(quantity, 0.0), None, "storey 2 is let go on a locked table")
            for quantity in bounds(configuration)
        ),
        duration=duration,
    )
