"""What bounds each quantity of a run: the guard's limits, and the stroke, range and supply of the shaker itself."""

from dataclasses import dataclass

from bench.config.model import BenchConfiguration
from bench.guard.quantities import NAMES

_LESS = "ask for less acceleration"
_FASTER = f"{_LESS}, or for higher frequencies"
_AWAY = f"{_LESS}, or keep the frequencies farther from the resonances of the specimen"


@dataclass(frozen=True)
class Bound:
    """The `limit` of one quantity in its SI `unit`, the key or part that sets it, and what helps when it binds."""

    quantity: str
    name: str
    unit: str
    limit: float
    owner: str
    remedy: str


def bounds(configuration: BenchConfiguration) -> dict[str, Bound]:
    """The bound of every quantity, by its key. Where several limit the same quantity, the least of them."""
    limits = configuration.limits

    def guarded(quantity: str) -> tuple[float, str]:
        return float(getattr(limits, quantity)), f"limits.{quantity}"

    laser = min(guarded("laser_range"), (1.0, "the laser's range"))
    found = {
        "drive_voltage": ("drive", "V", min([guarded("drive_voltage"), *_drive(configuration)]), _FASTER),
        "drive_slew": ("slew of the drive", "V/s", guarded("drive_slew"), f"{_LESS}, or for lower frequencies"),
        "displacement": (*NAMES["displacement"], min(guarded("displacement"), _stroke(configuration)), _FASTER),
        "velocity": (*NAMES["velocity"], guarded("velocity"), _FASTER),
        "acceleration": (*NAMES["acceleration"], guarded("acceleration"), _LESS),
        "force": (*NAMES["force"], guarded("force"), _LESS),
        "current": (*NAMES["current"], min([guarded("current"), *_current(configuration)]), _LESS),
        "heating": (*NAMES["heating"], guarded("heating"), _LESS),
        "laser_1": ("share of laser 1's half range", "1", laser, _AWAY),
        "laser_2": ("share of laser 2's half range", "1", laser, _AWAY),
        "drift": (*NAMES["drift"], guarded("drift"), _AWAY),
    }
    return {key: Bound(key, name, unit, *least, remedy) for key, (name, unit, least, remedy) in found.items()}


def _stroke(configuration: BenchConfiguration) -> tuple[float, str]:
    return configuration.half_stroke, "the shaker's stroke"


def _drive(configuration: BenchConfiguration) -> list[tuple[float, str]]:
    if configuration.backend == "hardware":
        return [(configuration.hardware.daq.output_range, "hardware.daq.output_range")]
    shaker = configuration.simulation.bench.shaker
    supply = "voltage_limit" if shaker.amplifier == "voltage" else "current_limit"
    largest = float(getattr(shaker, supply)) / shaker.gain
    return [(shaker.drive_range, "the shaker's drive_range"), (largest, f"the amplifier's {supply}")]


def _current(configuration: BenchConfiguration) -> list[tuple[float, str]]:
    if configuration.backend == "hardware":
        return []
    return [(configuration.simulation.bench.shaker.current_limit, "the amplifier's current_limit")]
