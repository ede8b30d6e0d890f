"""What free rocking asks of the bench: no drive, room in the laser's range, and filters that forget an impact."""

from bench.analysis.free_rocking.points import AFTER
from bench.config.model import BenchConfiguration
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from protocols.free_rocking.planned import beam_heights, planned_tilts, seen_displacement
from protocols.free_rocking.protocol import FreeRockingParameters
from protocols.free_rocking.sheet import expected_duration
from sim.errors import InvalidInput

LOWEST_CUTOFF = 1.25 / AFTER
"""Cutoff of a Butterworth low-pass of fourth order [Hz] that keeps 5 % of an impact's kink for `AFTER`: some 2 um."""

_MEETS = "the beam must meet the face of the tilted block: between {:.4f} and {:.4f} m at these tilts"

_NOT_WATCHED = "laser 2 looks at the block: it shows no drift, and none is watched"


def check(parameters: FreeRockingParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput where the laser cannot follow the block."""
    specimen = configuration.specimen
    low, high = beam_heights(parameters, specimen)
    for tilt in planned_tilts(parameters, specimen):
        far = seen_displacement(parameters, specimen, tilt)
        if far != far:
            raise InvalidInput("height", parameters.height, _MEETS.format(low, high))
        share = abs(far) / (0.5 * configuration.laser_ranges[1])
        allowed = configuration.limits.laser_range
        if share > allowed:
            needs = f"the face moves by {1e3 * abs(far):.1f} mm there, {share:.2f} of half the range of laser 2"
            raise InvalidInput("height", parameters.height, f"{needs}; limits.laser_range = {allowed:g}: look lower")
    if configuration.backend == "simulated":
        cutoff = configuration.simulation.bench.filter_unit.cutoff
        if cutoff < LOWEST_CUTOFF:
            allowed = f"impacts must be forgotten within {1e3 * AFTER:.0f} ms: at least {LOWEST_CUTOFF:g} Hz"
            raise InvalidInput("simulation.bench.filter_unit.cutoff", cutoff, allowed)


def forecast(parameters: FreeRockingParameters, configuration: BenchConfiguration) -> Forecast:
    """The demands: zero, but for the laser that sees the block."""
    specimen = configuration.specimen
    far = max(abs(seen_displacement(parameters, specimen, tilt)) for tilt in planned_tilts(parameters, specimen))
    where = f"{1e3 * far:.0f} mm of the block's face"
    nothing = "nothing is driven"
    demands: list[Demand] = []
    for quantity in bounds(configuration):
        if quantity == "laser_2":
            demands.append(Demand(quantity, far / (0.5 * configuration.laser_ranges[1]), None, where))
        elif quantity == "drift":
            demands.append(Demand(quantity, None, None, _NOT_WATCHED))
        else:
            demands.append(Demand(quantity, 0.0, None, nothing))
    return Forecast(
        demands=tuple(demands),
        duration=expected_duration(parameters, configuration),
        notes=("The drive stays at zero. The table is locked by hand, and unlocked at the end.",),
    )
