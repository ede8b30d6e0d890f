"""Measurement of a steady state, and its comparison with the prediction."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, log, tau
from typing import Any

from bench.analysis.cycles import Cycle
from bench.analysis.free_motion import CYCLES, KEPT, FreeMotion, Rate, free_motion, orbit_peak
from bench.analysis.gain import SensorAccuracy, SteadyPeak, gain, modulated_peak, steady_peak
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_accuracy import SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, LASER_1, LASER_2
from bench.analysis.steady import WINDOW, Steadiness, SteadyDetector
from bench.config.model import BenchConfiguration
from bench.control.sine import Sine, SineControl, SineResponse, Tolerance
from bench.engine.steps import Dwell, Fallen, Measured, Outcome, SetHarmonics, Step
from bench.prediction.bands import expanded_uncertainty
from protocols.common.calibrate import need_cycles
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from sim.gain import Layer, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit
from sim.table_orbit import table_orbit

INTERVAL = 6
"""Number of cycles between checks of the table's motion and of steadiness."""

TRANSIENT = 2
"""Number of cycles discarded at the beginning of an interval, in which the last correction of the drive takes
effect.
"""

AIM = 0.5
"""Fraction of the tolerances that is aimed at; the rest allows for disturbances of the table by a block that has not
settled.
"""


@dataclass(frozen=True)
class TableState:
    """Sine of the table at the end of a dwell: `turn` (see `Sine.turn`), the `shares` of its drive, and the `answer` of
    its fundamental per share.
    """

    turn: complex
    shares: tuple[complex, ...]
    answer: complex


@dataclass(frozen=True)
class Settled:
    """A measured dwell: its peak, its steadiness, and its settling time [s]. `amplitude_error` (relative) and
    `phase_error` [rad] are those of the table, after `updates` corrections of its drive. `motion` describes an unsteady
    motion, and `orbit` is the peak of its mean cycle if it revolves about a periodic motion. `table` is the state in
    which the dwell leaves the table; None where it is not known.
    """

    peak: SteadyPeak
    steadiness: Steadiness
    time: float
    amplitude_error: float
    phase_error: float
    updates: int
    motion: FreeMotion | None = None
    orbit: SteadyPeak | None = None
    table: TableState | None = None


@dataclass(frozen=True)
class Held:
    """Result of a hold: the peak of the held motion, errors of the table as in `Settled`, after `updates` corrections.

    `control` is the rms of the control over the measured cycles, as a share of the amplitude, and `captured` the number
    of cycles until the capture. `peak` is None where the hold was released for a `reason`. `rate` is that of the
    deviation without control after the measurement.
    """

    peak: SteadyPeak | None
    reason: str = ""
    amplitude_error: float = 0.0
    phase_error: float = 0.0
    updates: int = 0
    control: float = 0.0
    captured: int | None = None
    cycles: int = 0
    rate: Rate | None = None


JUDGED = (ACCELERATION, DISPLACEMENT, LASER_1, LASER_2)
"""Signals of the steadiness criterion: those of the sensors, since the jitter of a laser's delay affects only their
phase, but the amplitudes of u1 and drift, which are small differences.
"""

LASERS = (2, 3)
"""Indices of the lasers in `JUDGED`."""

SHORTEST = 10.0
"""Shortest wait [s]: at high frequencies two windows of cycles are shorter than the transient of the frame."""

PRECEDING = 96
"""Largest number of cycles before the measured ones from which the remaining transient is estimated."""

Report = Callable[[list[Cycle]], Generator[Step, Outcome, None]]
"""Callback that publishes the running gain at each check, from the cycles of the last window."""


def settle_and_measure(
    sine: Sine,
    parameters: HarmonicParameters,
    accuracy: SensorAccuracy,
    report: Report,
    frame: LinearFrame | None = None,
) -> Generator[Step, Outcome, Settled | Fallen]:
    """Hold the table at `sine` until every signal is steady, then measure.

    A motion that is not steady within the settle limit is measured as modulated. Without block, the `frame` checks the
    lasers.
    """
    detector = SteadyDetector(parameters.settle_tolerance, JUDGED, LASERS, sine.omega * accuracy.laser_timing)
    control = SineControl(
        parameters.harmonics,
        Tolerance(
            AIM * parameters.amplitude_tolerance,
            AIM * parameters.phase_tolerance,
            AIM * parameters.distortion_tolerance,
        ),
    )
    turn: complex | None = None
    updates, drive = 0, (1.0 + 0.0j,)
    recent: deque[Cycle] = deque(maxlen=WINDOW)
    constant: deque[Cycle] = deque(maxlen=KEPT)
    measured = max(parameters.measured_cycles, 2 * WINDOW)
    waited, over = 0.0, False
    while True:
        ready = over or (waited >= SHORTEST and detector.judge().steady)
        asked = measured if ready else INTERVAL
        outcome = yield Dwell(asked)
        if not isinstance(outcome, Measured):
            return Fallen()
        waited += asked * tau / sine.omega
        need_cycles(outcome.cycles, asked)
        turn = sine.turn(outcome.cycles[0]) if turn is None else turn
        for cycle in outcome.cycles:
            detector.push(cycle)
        # the first cycles after a correction of the drive are transient
        constant.extend(outcome.cycles if constant or not updates else outcome.cycles[TRANSIENT:])
        if ready:
            # judge the measured cycles at twice the tolerance, since at the tolerance itself noise would decide
            steadiness = detector.judge(allowance=2.0)
            if steadiness.steady or over:
                used = outcome.cycles[-parameters.measured_cycles :]
                table = SineResponse.of(used, sine, turn)
                motion = orbit = None
                if steadiness.steady:
                    peak = steady_peak(used, sine.omega, before=preceding(list(constant), used), frame=frame)
                else:
                    kept = list(constant)
                    peak, motion = modulated_peak(kept[-CYCLES:], sine.omega), free_motion(kept)
                    orbit = orbit_peak(kept, motion, sine.omega)
                state = TableState(turn, drive, complex(table.achieved[0] / table.played[0]))
                return Settled(
                    peak, steadiness, waited, table.amplitude_error, table.phase_error, updates, motion, orbit, state
                )
        recent.extend(outcome.cycles)
        yield from report(list(recent))
        over = waited >= parameters.settle_limit
        shares = control.next(SineResponse.of(outcome.cycles[TRANSIENT:], sine, turn))
        if shares is not None and not over:
            yield SetHarmonics(shares)
            drive = shares
            updates += 1
            detector.restart()
            constant.clear()


def linear_frame(configuration: BenchConfiguration) -> LinearFrame:
    """The bare frame, whose tests check the lasers."""
    grounded = configuration.laser_reference == "ground"
    return LinearFrame(configuration.known_specimen.bare(), grounded)


def checked(sensors: SensorUncertainty, references: Iterable[Settled]) -> SensorUncertainty:
    """Sensors whose linearity the steady tests of the bare frame have checked."""
    return replace(sensors, checks=tuple(each.peak.checks for each in references if each.peak.checks is not None))


def preceding(constant: Sequence[Cycle], used: Sequence[Cycle]) -> Sequence[Cycle]:
    """Cycles before the `used` ones at the end of those at a constant drive."""
    return constant[: -len(used)][-PRECEDING:]


_ROCKING = "rocking"

AMPLITUDE_NOTE = 0.002
"""Relative error of the table's amplitude above which a remark is added; the prediction is always for the achieved
amplitude.
"""

AMPLITUDE_STEP = 0.002
"""Relative change of the amplitude in the finite difference for the sensitivity."""

HARMONICS_NOTE = 0.01
"""Total harmonic distortion of the table above which a remark is added; the prediction is for a pure sine."""


def judge(
    settled: Settled,
    reference: Settled,
    omega: float,
    specimen: Specimen,
    known: SpecimenKnowledge,
    sensors: SensorUncertainty,
    starts: int,
    shaker: Shaker | None = None,
    harmonics: int = 1,
    held: Held | None = None,
) -> HarmonicPoint:
    """Point of a dwell, compared with the branch with the nearest peaks of drift and u1.

    `reference` is the bare frame's dwell at the same frequency, `known` the uncertainty of the `specimen`. The gains
    agree when they differ by no more than their combined expanded uncertainty, |E_n| <= 1 of ISO 13528. If the motion
    is not steady or the orbit is unstable, stability is also predicted on the table of `shaker`, which is controlled up
    to the harmonic `harmonics`. If the motion was then `held` on the rocking orbit, gain and comparison are those of
    the held motion, and the free one is described beside them.
    """
    peak, bare = settled.peak, reference.peak
    layers = predict_gain(specimen, omega, peak.amplitude, bare.amplitude).layers
    steady = settled.steadiness.steady
    name = _nearest(layers, peak) if steady else _ROCKING
    status = (PointStatus.STEADY if name == _ROCKING else PointStatus.RESTING) if steady else PointStatus.MODULATED
    layer = layers.get(name)
    slope = _amplitude_slope(specimen, omega, peak.amplitude, name)
    measured = gain(peak, bare, sensors, slope)
    prediction = predicted_fields(name, layer, known)
    on_table = None
    if shaker is not None and _ROCKING in layers and not (steady and layers[name].stable):
        on_table = _table_multiplier(layers[_ROCKING], shaker, harmonics)
    uncertainty, agrees = prediction["alpha_2_predicted_uncertainty"], None
    if steady and reference.steadiness.steady and layer and uncertainty is not None:
        agrees = abs(measured.alpha_2 - layer.alpha_2) <= hypot(measured.uncertainty, uncertainty)
    orbit = _orbit_fields(settled, reference, sensors, slope, layer, uncertainty)
    point = HarmonicPoint(
        omega_rad_s=omega,
        beta=specimen.label or 0.0,
        status=status,
        alpha_2=measured.alpha_2,
        alpha_2_uncertainty=measured.uncertainty,
        dominating=measured.budget.dominating,
        uncertainty_parts=measured.budget.as_json,
        **prediction,
        agrees=agrees,
        drift_peak_m=peak.drift,
        bare_drift_peak_m=bare.drift,
        amplitude_m_s2=peak.amplitude,
        bare_amplitude_m_s2=bare.amplitude,
        **_free_fields(settled.motion, bare.drift),
        **orbit,
        table_multiplier=on_table,
        starts_tried=starts,
        cycles_measured=peak.cycles,
        settle_time_s=settled.time,
        amplitude_error=settled.amplitude_error,
        phase_error_rad=settled.phase_error,
        table_harmonics=peak.harmonics,
        table_updates=settled.updates,
        reason="; ".join(
            (
                *_reasons(settled, reference, name, layers, agrees, on_table, orbit),
                *sensors.rough((bare.readings, peak.readings)),
            )
        ),
    )
    return point if held is None else _held_point(point, held, reference, specimen, known, sensors)


def _held_point(
    free: HarmonicPoint,
    held: Held,
    reference: Settled,
    specimen: Specimen,
    known: SpecimenKnowledge,
    sensors: SensorUncertainty,
) -> HarmonicPoint:
    """The point of a free motion that was then held; unchanged but for its reason if the hold was released."""
    peak, bare, omega = held.peak, reference.peak, free.omega_rad_s
    if peak is None:
        text = f"the motion was to be held on its orbit, and released after {held.cycles} cycles: {held.reason}"
        if held.cycles == 0:
            text = f"the motion could not be held on its orbit: {held.reason}"
        return free.model_copy(update={"reason": "; ".join((free.reason, text)).removeprefix("; ")})
    layers = predict_gain(specimen, omega, peak.amplitude, bare.amplitude).layers
    if _nearest(layers, peak) != _ROCKING or _ROCKING not in layers:
        text = "the motion on which the hold came to rest is not the rocking orbit"
        return free.model_copy(update={"reason": "; ".join((free.reason, text)).removeprefix("; ")})
    layer = layers[_ROCKING]
    measured = gain(peak, bare, sensors, _amplitude_slope(specimen, omega, peak.amplitude, _ROCKING))
    prediction, agrees = predicted_fields(_ROCKING, layer, known), None
    uncertainty = prediction["alpha_2_predicted_uncertainty"]
    if reference.steadiness.steady and uncertainty is not None:
        agrees = abs(measured.alpha_2 - layer.alpha_2) <= hypot(measured.uncertainty, uncertainty)
    remarks = [f"free: {free.reason}"] if free.reason else []
    remarks.append(f"held after {held.captured} cycles with a control of {100.0 * held.control:.2g} % of the amplitude")
    if abs(held.amplitude_error) > AMPLITUDE_NOTE:
        remarks.append(f"the table's amplitude has an error of {100.0 * held.amplitude_error:+.2f} %")
    if agrees is False:
        remarks.append("differs from the prediction by more than the uncertainty of both")
    return free.model_copy(
        update={
            "status": PointStatus.HELD,
            "alpha_2": measured.alpha_2,
            "alpha_2_uncertainty": measured.uncertainty,
            "dominating": measured.budget.dominating,
            "uncertainty_parts": measured.budget.as_json,
            **prediction,
            "agrees": agrees,
            **_rate_fields(held.rate),
            "control_share": held.control,
            "captured_cycles": held.captured,
            "drift_peak_m": peak.drift,
            "amplitude_m_s2": peak.amplitude,
            "amplitude_error": held.amplitude_error,
            "phase_error_rad": held.phase_error,
            "table_harmonics": peak.harmonics,
            "table_updates": free.table_updates + held.updates,
            "cycles_measured": peak.cycles,
            "reason": "; ".join(remarks),
        }
    )


def _table_multiplier(layer: Layer, shaker: Shaker, harmonics: int) -> float | None:
    """Modulus of the slowest multiplier on the table; None if no orbit is found."""
    try:
        return abs(table_orbit(layer.orbit, shaker, harmonics).slowest)
    except NoOrbit:
        return None


def _free_fields(motion: FreeMotion | None, bare: float) -> dict[str, Any]:
    """Fields of an unsteady motion; `bare` is the peak drift of the bare frame [m]."""
    if motion is None:
        return {}
    found = {
        "alpha_2_least": motion.least / bare,
        "alpha_2_greatest": motion.greatest / bare,
        "alpha_2_mean": motion.mean / bare,
        "repeats_cycles": motion.repeats or None,
    }
    return found | _rate_fields(motion.rate)


def _rate_fields(rate: Rate | None) -> dict[str, Any]:
    """Fields of the measured multiplier."""
    if rate is None:
        return {}
    return {
        "multiplier": rate.modulus,
        "multiplier_uncertainty": 2.0 * rate.uncertainty,
        "multiplier_angle_rad": rate.angle,
    }


def _orbit_fields(
    settled: Settled,
    reference: Settled,
    sensors: SensorUncertainty,
    amplitude_slope: float,
    layer: Layer | None,
    uncertainty: float | None,
) -> dict[str, Any]:
    """Fields for the orbit about which an unsteady motion revolves. Agreement of its gains is judged as for a steady
    motion.
    """
    if settled.orbit is None:
        return {}
    found, agrees = gain(settled.orbit, reference.peak, sensors, amplitude_slope), None
    if layer is not None and uncertainty is not None and reference.steadiness.steady:
        agrees = abs(found.alpha_2 - layer.alpha_2) <= hypot(found.uncertainty, uncertainty)
    return {
        "alpha_2_orbit": found.alpha_2,
        "alpha_2_orbit_uncertainty": found.uncertainty,
        "orbit_agrees": agrees,
    }


def predicted_fields(name: str, layer: Layer | None, known: SpecimenKnowledge) -> dict[str, Any]:
    """Prediction fields of a point for the branch `name`; each is None if the branch does not exist."""
    return {
        "layer": name if layer else "none",
        "alpha_2_predicted": layer.alpha_2 if layer else None,
        "alpha_2_predicted_uncertainty": expanded_uncertainty(layer, known) if layer else None,
        "predicted_stable": layer.stable if layer else None,
    }


def _amplitude_slope(specimen: Specimen, omega: float, amplitude: float, layer: str) -> float:
    """d ln alpha_2 / d ln amplitude of a branch, both tests at the same amplitude [m/s2]; 0 at the end of the branch.

    A central difference over the steady solver's orbits: the gains of the resting block and of the bare frame are
    independent of the amplitude.
    """
    around = (amplitude * (1.0 - AMPLITUDE_STEP), amplitude * (1.0 + AMPLITUDE_STEP))
    less, more = (predict_gain(specimen, omega, each).layers.get(layer) for each in around)
    if less is None or more is None:
        return 0.0
    return log(more.alpha_2 / less.alpha_2) / log(around[1] / around[0])


def _nearest(layers: dict[str, Layer], peak: SteadyPeak) -> str:
    """The branch whose peaks of drift and u1 are closest, in ratio, to the measured ones."""

    def distance(name: str) -> float:
        expected = layers[name].orbit.peaks
        return hypot(log(peak.drift / expected.drift), log(peak.u1 / expected.u1))

    return min(layers, key=distance, default=_ROCKING)


def _described(settled: Settled) -> str:
    """Description of an unsteady motion."""
    motion = settled.motion
    if motion is not None and motion.rate is not None and motion.rate.decays:
        decay, doubt = 100.0 * (1.0 - motion.rate.modulus), 200.0 * motion.rate.uncertainty
        return (
            f"the motion approaches a periodic one: the deviation decays by ({decay:.2g} +- {doubt:.1g}) % per "
            "cycle; with a longer --settle-limit it may become steady"
        )
    repeats = settled.steadiness.repeats if motion is None else motion.repeats
    return f"the motion repeats every {repeats} cycles" if repeats else "the motion does not repeat"


def _growth(fixed: float, on_table: float | None) -> str:
    """Growth or decay of disturbances, by the moduli of the slowest multipliers on fixed ground and on the table."""

    def change(modulus: float) -> str:
        return f"{'grow' if modulus > 1.0 else 'decay'} by {100.0 * abs(modulus - 1.0):.2g} % per cycle"

    found = f"{change(fixed)} on fixed ground"
    return found if on_table is None else f"{found} and {change(on_table)} on this table"


def _reasons(
    settled: Settled,
    reference: Settled,
    name: str,
    layers: dict[str, Layer],
    agrees: bool | None,
    on_table: float | None,
    orbit: Mapping[str, Any],
) -> Iterator[str]:
    """Remarks on the point."""
    state, peak = settled.steadiness, settled.peak
    if not state.steady:
        yield f"not steady after {settled.time:.0f} s: {_described(settled)}, spread {100.0 * state.spread:.1f} %"
        if on_table is not None:
            yield f"disturbances of the predicted orbit {_growth(layers[_ROCKING].multiplier, on_table)}"
        if orbit:
            gained = f"alpha_2 = {orbit['alpha_2_orbit']:.4f} +- {orbit['alpha_2_orbit_uncertainty']:.4f}"
            verdict = {True: ", which agrees with the prediction", False: ", which differs from the prediction"}
            yield f"its mean cycle is that of the orbit: {gained}{verdict.get(orbit['orbit_agrees'], '')}"
    elif name in layers and not layers[name].stable:
        yield f"steady while measured; disturbances of the predicted orbit {_growth(layers[name].multiplier, on_table)}"
    elif name != _ROCKING and _ROCKING in layers and layers[_ROCKING].stable:
        yield "no start reached the stable rocking motion; the block rests"
    if abs(settled.amplitude_error) > AMPLITUDE_NOTE:
        yield f"the table's amplitude has an error of {100.0 * settled.amplitude_error:+.2f} %"
    if peak.harmonics > HARMONICS_NOTE:
        yield f"the table's harmonics are {100.0 * peak.harmonics:.1f} % of its fundamental"
    if not reference.steadiness.steady:
        yield "the bare frame was not steady, so its drift is not a valid reference"
    if agrees is False:
        yield "the difference from the prediction exceeds the combined uncertainty"
