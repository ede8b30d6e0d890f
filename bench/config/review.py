"""Cross-checks of a whole configuration whose parts are valid.

`rockbench config check`, `--dry-run`, a run and the window all use this review. A limit beyond the bench's capabilities
would never trip: it is an error, or a notice if `limits.confirmed` names it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, sqrt

from bench.config.backend import RigSettings
from bench.config.model import BenchConfiguration
from bench.config.usual import damping_notices, specimen_notices, unusual
from bench.guard.limits import ramp_refusal
from sim.errors import InvalidInput
from sim.parameters import Parameters
from sim.specimen import Specimen

_ESTIMATE = 2.0
"""Largest accepted ratio of the limit on an estimated force or current to the estimate at the end of the
accelerometer's range; larger limits are treated as typing errors.
"""
_LONGEST_WAIT, _LONGEST_DEBOUNCE, _WORST_CLOCK = 60.0, 1.0, 0.1
"""Longest accepted delays of the guard [s], first for a lost or constant signal, late samples and heating, then for any
other exceeded limit; and a relative clock error greater than that of any quartz clock.
"""
_LEAST_ERROR = 1e-7
"""Smallest plausible value of the largest coefficient of a laser's linearity error [m]."""
_REACH = {
    "acceleration": (0.5, 5000.0),
    "velocity": (0.02, 50.0),
    "displacement": (2e-4, 2.0),
    "force": (1.0, 1e5),
    "strain": (1e-5, 0.05),
    "current": (0.02, 1000.0),
}
"""Usual measuring ranges of each kind of sensor on benches of this size, in SI units, from common data sheets."""
_LEAST_SHARE = 0.01
"""Fraction of a channel's range below which a limit is unusual."""
_NOISE = (1e-7, 1e-4)
"""Usual amplitude spectral densities of a channel's noise, relative to its range [1/Hz^0.5]. The upper one is that of
noise with an rms of 0.3 % of the range in a band of 1 kHz.
"""


@dataclass(frozen=True)
class Review:
    """Result of a review: `refusals`, each naming key, value and remedy, and `notices` about unusual values."""

    refusals: tuple[InvalidInput, ...]
    notices: tuple[str, ...]

    def require(self) -> None:
        """Raise the first refusal, if there is one."""
        if self.refusals:
            raise self.refusals[0]


@dataclass(frozen=True)
class _Reach:
    """The largest value of a limited quantity that the bench can reach, and the component that determines it."""

    limit: str
    most: float
    unit: str
    owner: str


def review(configuration: BenchConfiguration) -> Review:
    """Review of a configuration, independent of any protocol."""
    confirmed, refusals, notices = configuration.limits.confirmed, list[InvalidInput](), list[str]()
    for reach in _reaches(configuration):
        value = float(getattr(configuration.limits, reach.limit))
        if value <= reach.most:
            continue
        why = f"it can never trip: {reach.owner} allows at most {reach.most:.4g} {reach.unit}".rstrip()
        if reach.limit in confirmed:
            notices.append(f"limits.{reach.limit} = {value:g}: {why}; limits.confirmed names it")
        else:
            remedy = f'{why}; lower it, or name it in limits.confirmed = ["{reach.limit}"]'
            refusals.append(InvalidInput(f"limits.{reach.limit}", value, remedy))
    refusals += _contradictions(configuration)
    refusals += _time_outs(configuration)
    known = tuple(f"limits.{name} = " for name in confirmed)
    notices += (notice for notice in _unusual(configuration) if not notice.startswith(known))
    return Review(tuple(refusals), tuple(notices))


def _reaches(configuration: BenchConfiguration) -> Iterator[_Reach]:
    limits, rate = configuration.limits, configuration.sample_rate
    bench = "simulation.bench" if configuration.backend == "simulated" else configuration.table
    position, acceleration, output = _ranges(configuration)
    yield _Reach("drive_voltage", *output)
    step = f"a step between the drive limits (limits.drive_voltage = {limits.drive_voltage:g} V"
    owner = f"{step}, {bench}.sample_rate = {rate:g} 1/s)"
    yield _Reach("drive_slew", 2.0 * limits.drive_voltage * rate, "V/s", owner)
    shaker = f"{bench}.shaker" if configuration.backend == "simulated" else bench
    stroke = configuration.half_stroke, "m", f"the stroke ({shaker}.half_stroke)"
    travel = min(stroke, position)
    yield _Reach("displacement", *travel)
    # |v|^2 <= 2 |x| |a| for a motion from rest to rest with these maxima (J. Hadamard, C. R. Soc. Math. France 41,
    # 1914)
    owner = f"a motion within {travel[2]} and {acceleration[2]}"
    yield _Reach("velocity", sqrt(2.0 * travel[0] * acceleration[0]), "m/s", owner)
    yield _Reach("acceleration", *acceleration)
    yield from _loads(configuration, acceleration[0])
    yield _Reach("laser_range", 1.0, "", "the laser's range")
    keys = "rig.laser_1_range" if bench == "rig" else f"{bench}.laser_1.measuring_range"
    ranges = f"the sum of the lasers' half ranges ({keys} and laser_2)"
    yield _Reach("drift", sum(configuration.laser_half_ranges), "m", ranges)
    if configuration.backend == "hardware":
        yield _Reach("late", configuration.hardware.daq.buffer, "s", "the input buffer (hardware.daq.buffer)")


def _loads(configuration: BenchConfiguration, acceleration: float) -> Iterator[_Reach]:
    """Largest possible force and current: the shaker's capacity, a sensor's range, or an estimate from the motion."""
    found: dict[str, _Reach] = {}
    shaker_model, hardware, settings = configuration.shaker_model, configuration.hardware, configuration.settings
    if configuration.backend == "simulated":
        shaker, key = configuration.simulation.bench.shaker, "simulation.bench.shaker"
        current = f"current_limit = {shaker.current_limit:g} A"
        owner = f"the shaker's capacity ({key}.bl = {shaker.bl:g} N/A times {current})"
        found["force"] = _Reach("force", shaker.bl * shaker.current_limit, "N", owner)
        owner = f"the amplifier's capacity ({key}.{current})"
        found["current"] = _Reach("current", shaker.current_limit, "A", owner)
    else:
        if shaker_model is not None:
            force = _ESTIMATE * shaker_model.force(acceleration)
            table = configuration.table
            masses = f"{table}.moving_mass = {settings.moving_mass:g} kg" if settings.moving_mass else ""
            owner = f"twice the estimate from the range of the accelerometer ({masses}, {table}.force_constant = "
            owner += f"{shaker_model.force_constant:g} N/A)"
            found["force"] = _Reach("force", force, "N", owner)
            found["current"] = _Reach("current", force / shaker_model.force_constant, "A", owner)
        for name, unit, sensor in (("force", "N", hardware.table_force), ("current", "A", hardware.coil_current)):
            if sensor is not None and configuration.backend == "hardware":
                key = "hardware.table_force" if name == "force" else "hardware.coil_current"
                found[name] = _Reach(name, *_range_of(key, unit, sensor.range, sensor.sensitivity, sensor.zero))
    yield from found.values()
    if (current := found.get("current")) is not None:
        yield _Reach("heating", current.most, "A", current.owner)


_Range = tuple[float, str, str]
"""Largest possible value, its unit, and the component that determines it."""


def _ranges(configuration: BenchConfiguration) -> tuple[_Range, _Range, _Range]:
    """Largest possible displacement, acceleration and drive voltage, from the ranges of sensors and output."""
    if configuration.backend == "simulated":
        bench, key = configuration.simulation.bench, "simulation.bench"
        volts = bench.converter.range
        return (
            _range_of(f"{key}.displacement_sensor", "m", volts, bench.displacement_sensor.sensitivity),
            _range_of(f"{key}.accelerometer", "m/s2", volts, bench.accelerometer.sensitivity),
            (bench.shaker.drive_range, "V", f"the range of the drive ({key}.shaker.drive_range)"),
        )
    if isinstance(rig := configuration.settings, RigSettings):
        acceleration = inf if rig.acceleration_range is None else rig.acceleration_range
        return (
            (inf, "m", "the range of the displacement sensor"),
            (acceleration, "m/s2", "the range of the accelerometer (rig.acceleration_range)"),
            (rig.drive_range, "V", "the range of the drive (rig.drive_range)"),
        )
    hardware = configuration.hardware
    x, a = hardware.table_displacement, hardware.table_acceleration
    return (
        _range_of("hardware.table_displacement", "m", x.range, x.sensitivity, x.zero),
        _range_of("hardware.table_acceleration", "m/s2", a.range, a.sensitivity, a.zero),
        (hardware.daq.output_range, "V", "the range of the drive (hardware.daq.output_range)"),
    )


def _range_of(key: str, unit: str, volts: float, sensitivity: float, zero: float = 0.0) -> _Range:
    owner = f"the range of {key} ({volts:g} V, sensitivity = {sensitivity:g} V/({unit}))"
    return (volts + abs(zero)) / abs(sensitivity), unit, owner


def _contradictions(configuration: BenchConfiguration) -> Iterator[InvalidInput]:
    simulated = configuration.backend == "simulated"
    if (refused := ramp_refusal(configuration.limits, configuration.ramps)) is not None:
        yield refused
    for key, (value, most, unit) in _waits(configuration).items():
        if value > most:
            yield InvalidInput(f"limits.{key}", value, f"it must not exceed {most:g}{unit} to be effective")
    table = "simulation.bench.shaker" if simulated else configuration.table
    low, high = configuration.table_band
    if low >= high:
        yield InvalidInput(f"{table}.band_low", low, f"it must be below band_high = {high:g} Hz")
    if high > 0.5 * configuration.sample_rate:
        half = f"half the sample rate, {0.5 * configuration.sample_rate:g} Hz"
        yield InvalidInput(f"{table}.band_high", high, f"it must not exceed {half}")
    if simulated:
        shaker, specimen = configuration.simulation.bench.shaker, configuration.known_specimen
        model = configuration.shaker_model
        needed = model.force(specimen.uplift_acceleration) if model is not None else 0.0
        if needed > (most := shaker.bl * shaker.current_limit):
            frame, block = specimen.frame, specimen.block
            allowed = (
                f"the uplift acceleration requires {needed:.4g} N, but the shaker provides at most {most:.4g} N: check "
                f"that the masses are in kg and the density is in kg/m3 (m1 = {frame.m1:g}, m2 = {frame.m2:g}, "
                f"specimen.block.rho = {block.rho:g}, s = {block.s:g}, specimen.g = {specimen.g:g}, "
                f"simulation.bench.shaker.moving_mass = {shaker.moving_mass:g})"
            )
            yield InvalidInput("specimen.frame.m1", specimen.frame.m1, allowed)


def _time_outs(configuration: BenchConfiguration) -> Iterator[InvalidInput]:
    """Refusals of time-outs that are shorter than the lead, by which the loop may be late without consequence: it also
    waits for late values of a laser as long, and the enable chain would open at full drive.
    """
    if configuration.backend != "hardware":
        return
    daq, block = configuration.hardware.daq, configuration.acquisition.block_duration
    key, lead = min(
        (("acquisition.lead", configuration.acquisition.lead), ("limits.late", configuration.limits.late)),
        key=lambda each: each[1],
    )
    late = f"the program may be late by {key} = {lead:g} s"
    # the watchdog is reset after a quarter of its time-out at the earliest
    found = [("watchdog", daq.watchdog, (block + lead) * 4.0 / 3.0, "four thirds of a block and this time")]
    if daq.heartbeat is not None:
        found.append(("heartbeat.timeout", daq.heartbeat.timeout, 2.0 * block + lead, "two blocks and this time"))
    for name, value, least, blocks in found:
        if value is not None and value < least:
            yield InvalidInput(
                f"hardware.daq.{name}",
                value,
                f"{late}: set a time-out of at least {blocks}, {least:.3g} s, or reduce {key}",
            )


def _waits(configuration: BenchConfiguration) -> dict[str, tuple[float, float, str]]:
    """Delays of the guard [s] and its relative tolerance of clock errors: value, upper bound and unit, by key."""
    limits = configuration.limits
    found = {key: (float(getattr(limits, key)), _LONGEST_WAIT, " s") for key in ("sensor_loss", "stuck", "late")}
    found["clock"] = limits.clock, _WORST_CLOCK, ""
    for key in type(limits.debounce).model_fields:
        most = _LONGEST_WAIT if key == "heating" else _LONGEST_DEBOUNCE
        found[f"debounce.{key}"] = float(getattr(limits.debounce, key)), most, " s"
    return found


def _unusual(configuration: BenchConfiguration) -> Iterator[str]:
    """Notices about unusual values in all parts of the configuration that the backend uses."""
    unused = {"simulation", "hardware", "rig"} - {configuration.table}
    for name in type(configuration).model_fields:
        part = getattr(configuration, name)
        if name == "specimen":
            yield from specimen_notices(part)
        elif isinstance(part, Parameters) and name not in unused:
            yield from unusual(part, f"{name}.")
    true = configuration.simulation.specimen if configuration.backend == "simulated" else None
    if true is not None:
        own = set(unusual(true, "simulation.specimen."))
        yield from (each for each in specimen_notices(true, "simulation.specimen.") if each not in own)
    yield from _channels(configuration)
    yield from _findings(configuration)
    yield from _curves(configuration)


def _channels(configuration: BenchConfiguration) -> Iterator[str]:
    """Notices about additional sensors with an unusual measuring range, or with a limit or noise that is unusual for
    that range.
    """
    for place, channel in enumerate(configuration.channels):
        item = f"channels[{place}] ({channel.name})"
        yield from unusual(channel, f"channels[{place}].")
        reach = (channel.range - abs(channel.zero)) / abs(channel.sensitivity)
        low, high = _REACH.get(channel.measures, (0.0, inf))
        if not low <= reach <= high:
            scale = f"sensitivity = {channel.sensitivity:g}, zero = {channel.zero:g} V and range = {channel.range:g} V"
            yield f"{item}: with {scale} its range is {reach:.3g} {channel.unit}; usual values: {low:g} to {high:g}"
        if channel.limit is not None and channel.limit < _LEAST_SHARE * reach:
            yield f"{item}: limit = {channel.limit:g} {channel.unit} is below 1 % of its range, {reach:.3g}"
        quietest, loudest = (share * reach for share in _NOISE)
        if channel.noise_density and not quietest <= channel.noise_density <= loudest:
            noise = f"noise_density = {channel.noise_density:g} {channel.unit}/Hz^0.5"
            usual = f"usual values: {quietest:.2g} to {loudest:.2g}"
            yield f"{item}: {noise} with a range of {reach:.3g} {channel.unit}; {usual}"


def _findings(configuration: BenchConfiguration) -> Iterator[str]:
    """Notices about identified values that are far from the assumed ones or have an implausible uncertainty."""
    for place, finding in enumerate(configuration.identified.findings if configuration.identified else ()):
        item = f"identified.findings[{place}] ({finding.name})"
        relative = finding.standard_uncertainty / finding.value if finding.value else 0.0
        if relative and not 2e-5 <= relative <= 0.5:
            yield (
                f"{item}: standard_uncertainty = {finding.standard_uncertainty:g} is {relative:.2g} times the value; "
                "usual values: 2e-5 to 0.5 times"
            )
        assumed = _assumed(configuration.specimen, finding.name)
        if assumed and finding.value and not 0.2 <= finding.value / assumed <= 5.0:
            ratio = finding.value / assumed
            yield f"{item}: value = {finding.value:g} is {ratio:.3g} times the assumed value, {assumed:g}"
    frame = configuration.known_specimen.frame
    if frame != configuration.specimen.frame:
        yield from damping_notices(frame, "identified: ")


def _curves(configuration: BenchConfiguration) -> Iterator[str]:
    """Notices about calibrations with an implausibly small laser error."""
    if configuration.calibrated is not None:
        for number, curve in enumerate(configuration.calibrated.lasers, 1):
            largest = max(abs(each) for each in curve.error)
            if largest < _LEAST_ERROR:
                item = f"calibrated.laser_{number}.error"
                yield f"{item}: its largest coefficient, {largest:g} m, is implausibly small (below {_LEAST_ERROR:g} m)"


def _assumed(specimen: Specimen, name: str) -> float | None:
    if name.startswith("k_c:"):
        return float(name.removeprefix("k_c:")) * (specimen.spring_k1 or specimen.frame.k1)
    return getattr(specimen.frame, name, None) or getattr(specimen.block, name, None)
