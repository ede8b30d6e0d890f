"""Steps of the harmonic campaign (section 4.3 of the paper).

1. Bare frame: calibrate the drive; then, at each frequency, hold the amplitude, wait for the steady state, and measure.
2. Each spring: mount it, and calibrate the drive again at a level that leaves the block at rest; then, at each
   frequency, try the planned starts until the motion is steady or held. If a start topples the block, the test is
   ended, the block is set upright, and the next start is tried. If no start leads to a steady or held motion, the first
   motion without a fall is reported.
"""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace

from bench.analysis.running_gain import RunningGain, shared_draws
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.config.model import BenchConfiguration
from bench.control.cycle_identification import Control, IdentifyingStabiliser, load_solvers
from bench.control.oscillator import DriveCalibration, Segment
from bench.control.sine import Sine
from bench.control.stabiliser import GROWTH, Stabiliser, StabiliserDesign
from bench.control.starts import Start
from bench.engine.steps import (
    Arm,
    Calibrate,
    Dwell,
    Fallen,
    Measured,
    Outcome,
    Publish,
    RampOut,
    SetHarmonics,
    Step,
    Sweep,
)
from bench.events import PointFinished, StepStarted, Warned
from drivers.rig import RigError
from protocols.common.sine.calibration import NO_BLOCK, REST, bare_calibration, end_test, spring_calibration
from protocols.common.sine.holding import SLOW, hold, prepared, too_late
from protocols.common.sine.pace import Pace
from protocols.common.sine.settling import (
    Held,
    Settled,
    TableState,
    checked,
    linear_frame,
    settle_and_measure,
)
from protocols.harmonic.approach import far, stable_above, with_pause
from protocols.harmonic.conditions import ROCKING, Conditions, predicted_fields
from protocols.harmonic.free_prediction import with_free_prediction
from protocols.harmonic.judgement import judge
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from protocols.harmonic.running import RunningPoint
from sim.gain import Branch, predict_gain
from sim.specimen import Specimen
from sim.steady import Orbit

BARE_CHANGE = 4.0
"""Duration of the sweep between frequencies of the bare frame [s]."""


class HarmonicPlan:
    """Steps of a campaign, and the results of the bare frame that later steps require."""

    def __init__(
        self,
        parameters: HarmonicParameters,
        configuration: BenchConfiguration,
        starts: Mapping[tuple[float, float], Sequence[Start]],
    ) -> None:
        self._parameters, self._configuration, self._starts = parameters, configuration, starts
        self._specimen = configuration.known_specimen
        self._amplitude = parameters.amplitude_factor * self._specimen.uplift_acceleration
        self._pace = Pace(parameters.omega, 1 + len(parameters.beta))
        self._bare: dict[float, Settled] = {}
        self._running_sensors = configuration.sensors
        self._target_branches: dict[tuple[float, float], Branch | None] = {}
        self._points: list[HarmonicPoint] = []
        self._draws = shared_draws()

    def steps(self) -> Generator[Step, Outcome, Sequence[HarmonicPoint]]:
        """Steps of the complete campaign; returns its points."""
        calibration = yield from self._bare_frame()
        for beta in self._parameters.beta:
            plans = {omega: self._starts[beta, omega] for omega in self._parameters.omega}
            yield from self._spring(self._specimen.coupled(beta), plans, calibration)
        return self._points

    def _bare_frame(self) -> Generator[Step, Outcome, DriveCalibration]:
        bare = self._specimen.bare()
        calibration = yield from bare_calibration(self._parameters, self._parameters.omega, self._amplitude, bare)
        duration = self._parameters.ramp_time
        for omega in self._parameters.omega:
            yield Publish(StepStarted(f"bare frame at {omega:g} rad/s"))
            yield Sweep((Segment(duration, self._amplitude, omega),))
            settled = yield from self._settle(omega, None, calibration)
            if isinstance(settled, Fallen):
                raise RigError(NO_BLOCK)
            if not settled.steadiness.steady:
                yield Publish(
                    Warned(
                        f"the bare frame is not steady at {omega:g} rad/s: its drift is not a valid reference for "
                        "the gains at this frequency"
                    )
                )
            self._bare[omega] = settled
            self._pace.finished(omega)
            duration = BARE_CHANGE
        yield RampOut()
        # takes time, and is therefore evaluated while the table is at rest
        self._running_sensors = self._sensors.found_by_harmonics() if self._parameters.laser_block else self._sensors
        return calibration

    def _spring(
        self, specimen: Specimen, plans: Mapping[float, Sequence[Start]], calibration: DriveCalibration
    ) -> Generator[Step, Outcome, None]:
        starts = [start for each in plans.values() for start in each]
        level = self._parameters.calibration_level * self._amplitude
        calibration = yield from spring_calibration(specimen, self._parameters.omega, starts, level, calibration)
        for omega in self._parameters.omega:
            point = yield from self._point(specimen, omega, calibration, plans[omega])
            self._pace.finished(omega)
            yield Publish(self._pace.progress(f"beta = {specimen.label:g} at {omega:g} rad/s finished"))
            self._points.append(point)
            yield Publish(PointFinished(point))

    def _point(
        self, specimen: Specimen, omega: float, calibration: DriveCalibration, starts: Sequence[Start]
    ) -> Generator[Step, Outcome, HarmonicPoint]:
        """Try the planned starts until a motion is steady or held; if the predicted orbit is unstable, until the block
        does not fall. Otherwise returns the first point without a fall or, after falls only, an overturned point.
        """
        found: HarmonicPoint | None = None
        falls = 0
        orbit = self._orbit(specimen, omega)
        slow = orbit is not None and orbit.multiplier > SLOW
        late = too_late(self._configuration, omega)
        # also prepared if a correction would come too late: the first start then gives the reason
        held_by = self._prepared(orbit) if slow or late is not None else None
        model_free = self._parameters.hold and self._parameters.model_free
        pause: float | None = None
        if model_free and late is None:
            load_solvers()
            pause = stable_above(specimen, omega, self._amplitude)
        for tried, start in enumerate(starts, 1):
            where = f"beta = {specimen.label:g} at {omega:g} rad/s, start {tried} of {len(starts)}: {start.name}"
            yield Publish(StepStarted(f"{where}, chance {start.chance:.0%}"))
            yield Arm(REST)
            yield Calibrate(calibration)
            settled: Settled | Fallen | None = None
            if not isinstance((yield Sweep(start.segments)), Fallen):
                settled = yield from self._settle(omega, specimen, calibration)
            held: Held | Fallen | None = None
            stabiliser = self._stabiliser(omega, settled, held_by) if isinstance(settled, Settled) else None
            if isinstance(settled, Settled) and stabiliser is not None:
                if late is not None:
                    held = Held(None, late)
                else:
                    table: TableState | Fallen | None = settled.table
                    if model_free and far(settled):
                        yield Publish(StepStarted(f"{where}: starting again, to identify the motion near its orbit"))
                        yield from end_test(specimen, fast=False)
                        table = yield from self._started_again(with_pause(start, pause), omega, calibration, settled)
                    how = ", without a model" if model_free else ""
                    yield Publish(StepStarted(f"{where}: holding the motion on its orbit{how}"))
                    held = yield from self._hold(specimen, omega, calibration, settled, table, stabiliser)
            if not isinstance(settled, Settled):
                falls += 1
                yield from end_test(specimen, fast=True)
                continue
            yield from end_test(specimen, fast=isinstance(held, Fallen) or (held is not None and held.fallen))
            if isinstance(held, Fallen):
                held = Held(None, "the block fell")
            configuration, parameters = self._configuration, self._parameters
            tested = omega, specimen, self._bare[omega], self._sensors
            point = judge(settled, Conditions.of(*tested, configuration, parameters), tried, held)
            point = with_free_prediction(point, specimen, self._amplitude, configuration, parameters.harmonics)
            point = point.model_copy(update={"start_chance": start.chance})
            if point.status in (PointStatus.STEADY, PointStatus.HELD) or not point.predicted_stable:
                return point
            found = found or point
            if held_by is None and not settled.steadiness.steady:
                # if the motion after the next start does not become steady either, it is held
                held_by = self._prepared(orbit)
        if found is not None:
            return found.model_copy(update={"starts_tried": len(starts)})
        return self._overturned(specimen, omega, falls, starts[0].chance)

    def _overturned(self, specimen: Specimen, omega: float, falls: int, chance: float) -> HarmonicPoint:
        bare = self._bare[omega].peak
        branch = self._target_branch(specimen, omega)
        orbit = "no rocking orbit is predicted" if branch is None else "the predicted orbit is "
        orbit += "" if branch is None else "stable" if branch.stable else "unstable"
        return HarmonicPoint(
            omega_rad_s=omega,
            beta=specimen.label or 0.0,
            status=PointStatus.OVERTURNED,
            **predicted_fields(ROCKING, branch, self._configuration.known_on_table),
            bare_drift_peak_m=bare.drift,
            bare_amplitude_m_s2=bare.amplitude,
            starts_tried=falls,
            start_chance=chance,
            reason=f"the block fell after every start ({falls} tried); {orbit}",
        )

    def _target_branch(self, specimen: Specimen, omega: float) -> Branch | None:
        """The predicted rocking branch at the nominal amplitude, computed once per point."""
        key = specimen.k_c, omega
        if key not in self._target_branches:
            bare = self._bare[omega].peak.amplitude
            self._target_branches[key] = predict_gain(specimen, omega, self._amplitude, bare).rocking
        return self._target_branches[key]

    def _orbit(self, specimen: Specimen, omega: float) -> Orbit | None:
        branch = self._target_branch(specimen, omega)
        return branch.orbit if branch else None

    def _prepared(self, orbit: Orbit | None) -> StabiliserDesign | None:
        if not self._parameters.hold:
            return None
        return prepared(orbit, self._configuration.simulated_shaker, self._parameters.harmonics)

    def _stabiliser(self, omega: float, settled: Settled, design: StabiliserDesign | None) -> Control | None:
        """Stabiliser of a motion that is to be held, because it is not steady or its orbit is predicted to be unstable
        on the table; None for any other motion. `design` is that of the predicted orbit, None without one.
        """
        unstable = design is not None and abs(design.cycle_map.slowest) > 1.0
        if not self._parameters.hold or (settled.steadiness.steady and not unstable):
            return None
        if self._parameters.model_free:
            return IdentifyingStabiliser(omega, self._parameters.hold_authority)
        return None if design is None else Stabiliser(design, self._parameters.hold_authority)

    def _started_again(
        self, segments: tuple[Segment, ...], omega: float, calibration: DriveCalibration, settled: Settled
    ) -> Generator[Step, Outcome, TableState | Fallen | None]:
        """Start again, with the harmonics of the drive found before; returns the state of the table."""
        yield Arm(REST)
        yield Calibrate(calibration)
        if isinstance((yield Sweep(segments)), Fallen):
            return Fallen()
        outcome = yield Dwell(1)
        if not isinstance(outcome, Measured):
            return Fallen()
        if settled.table is None or not outcome.cycles:
            return None
        yield SetHarmonics(settled.table.shares)
        return replace(settled.table, turn=Sine(omega, self._amplitude, calibration).turn(outcome.cycles[0]))

    def _hold(
        self,
        specimen: Specimen,
        omega: float,
        calibration: DriveCalibration,
        settled: Settled,
        table: TableState | Fallen | None,
        stabiliser: Control,
    ) -> Generator[Step, Outcome, Held | Fallen]:
        """Hold the present motion on its orbit, and measure it; `settled` is the free motion, `table` the present state
        of the table.
        """
        if isinstance(table, Fallen):
            return table
        if table is None:
            return Held(None, "the amplitude and phase of the table are unknown")
        sine = Sine(omega, self._amplitude, calibration)
        free = settled.peak.drift
        limits = self._configuration.limits
        largest = min(GROWTH * free, limits.warning.drift * limits.drift)
        report = self._running(omega, specimen).report
        return (
            yield from hold(
                sine,
                table,
                stabiliser,
                specimen.label or 0.0,
                largest,
                self._parameters,
                self._configuration.analysis,
                report,
            )
        )

    def _settle(
        self, omega: float, specimen: Specimen | None, calibration: DriveCalibration
    ) -> Generator[Step, Outcome, Settled | Fallen]:
        """Wait for a steady state and measure; publishes the running alpha_2 and its prediction."""
        sine = Sine(omega, self._amplitude, calibration)
        running = self._running(omega, specimen)
        frame = linear_frame(self._configuration) if specimen is None else None
        free_cycles = 0 if specimen is None else self._parameters.free_cycles or 0
        accuracy, pays = self._configuration.analysis, running.worth_waiting
        return settle_and_measure(sine, self._parameters, accuracy, running.report, frame, free_cycles, pays)

    def _running(self, omega: float, specimen: Specimen | None) -> RunningPoint:
        """The running gain of a test."""
        reference = self._bare.get(omega)
        gain: RunningGain | None = None
        predicted = float("nan")
        if specimen is not None and reference is not None:
            gain = RunningGain(reference.peak, self._running_sensors, self._draws)
            branch = self._target_branch(specimen, omega)
            predicted = branch.alpha_2 if branch else predicted
        return RunningPoint(omega, specimen.label if specimen else None, gain, predicted, self._pace)

    @property
    def _sensors(self) -> SensorUncertainty:
        return checked(self._configuration.sensors, self._bare.values())
