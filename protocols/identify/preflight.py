"""What an identification will ask of the bench: its motions are known beforehand, and linear."""

from bench.config.model import BenchConfiguration
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from protocols.identify.level import planned
from protocols.identify.parameters import IdentifyParameters
from protocols.identify.sheet import expected_duration

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: the probes find out, within limits.drive_voltage",
    "drive_slew": "nothing is known of this table: the probes find out, within limits.drive_slew",
    "force": "the moving mass is not known: give hardware.moving_mass and hardware.force_constant",
    "current": "the force constant is not known: give hardware.moving_mass and hardware.force_constant",
    "heating": "the force constant is not known: give hardware.moving_mass and hardware.force_constant",
}


def forecast(parameters: IdentifyParameters, configuration: BenchConfiguration) -> Forecast:
    """The demands of the strongest multisine. Raises InvalidInput for a band that cannot be made."""
    found = planned(parameters, configuration)
    where = f"a multisine of {found.level:.3g} m/s2"
    demands = [
        Demand(quantity, found.asked[quantity], None, where)
        if quantity in found.asked
        else Demand(quantity, None, None, _UNKNOWN[quantity])
        for quantity in bounds(configuration)
    ]
    return Forecast(demands=tuple(demands), duration=expected_duration(parameters, found))
