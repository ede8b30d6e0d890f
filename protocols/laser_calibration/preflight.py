"""What a laser calibration will ask of the bench: sines of the table with a rigid load on it."""

from bench.config.model import BenchConfiguration
from bench.control.legs import Leg, program
from bench.preflight.asked import UNKNOWN_SHAKER
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from bench.preflight.load import load
from bench.preflight.response import response_of
from protocols.laser_calibration.parameters import LaserCalibrationParameters
from protocols.laser_calibration.sheet import START, expected_duration

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: the probes find out, within limits.drive_voltage",
    "drive_slew": "nothing is known of this table: the probes find out, within limits.drive_slew",
    **UNKNOWN_SHAKER,
}


def forecast(parameters: LaserCalibrationParameters, configuration: BenchConfiguration) -> Forecast:
    """The demands of the largest pass. The clamped storeys move as the table does."""
    amplitude, omega, frame = parameters.amplitude, parameters.omega, configuration.known_specimen.frame
    duration = expected_duration(parameters)
    level = amplitude * omega**2
    asked = load(
        program((Leg(START, level, omega), Leg(duration, level, omega))),
        START,
        duration,
        payload=frame.m1 + frame.m2,
        mover=configuration.mover,
        response=response_of(configuration),
        heating_time=configuration.limits.heating_time,
    )
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    asked |= {"laser_1": amplitude / halves[0], "laser_2": amplitude / halves[1], "drift": 0.0}
    where = f"the pass of {1e3 * amplitude:.1f} mm"
    demands = [
        Demand(quantity, asked[quantity], None, where)
        if quantity in asked
        else Demand(quantity, None, None, _UNKNOWN[quantity])
        for quantity in bounds(configuration)
    ]
    return Forecast(demands=tuple(demands), duration=duration)
