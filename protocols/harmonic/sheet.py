"""The lab sheet of the harmonic campaign (section 4.3 of the paper).

1. The bare frame: calibrate the drive, then at each frequency hold the amplitude, wait for the steady state, measure.
2. For each spring: mount it, calibrate the drive anew at a level that leaves the block at rest, and at each frequency
   try the planned starts until one is steady. A start that topples the block is ended, the block is stood up, and the
   next one is tried; a point that no start reaches is reported as what it did.
"""

from collections.abc import Generator, Mapping, Sequence
from math import tau

from bench.analysis.cycles import Cycle
from bench.analysis.gain import gain, steady_peak
from bench.config.model import BenchConfiguration
from bench.control.answer import Sine
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.control.starts import Start
from bench.engine.steps import Arm, Calibrate, Fallen, Follow, Handle, Outcome, RampOut, Say, Step
from bench.events import Estimate, PointFinished, Progress, StepStarted, Warned
from bench.prediction.model_uncertainty import expanded_uncertainty
from drivers.rig import Handwork, RigError
from protocols.common.calibrate import calibrate_drive, harmonic_frequencies
from protocols.harmonic.judge import judge
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from protocols.harmonic.settle import Look, Settled, settle_and_measure
from protocols.harmonic.stages import BARE_CHANGE, spring_calibration
from sim.gain import predict_gain
from sim.specimen import Specimen

REST = 2.0
"""Time at rest before a test, over which the zero of the signals is taken [s]."""

NO_BLOCK = "the first storey is pulled aside although the block was taken off: check lasers and specimen"

FALLEN_REQUEST = "The block has fallen: stand it up again."

OVERHEAD = 30.0
"""Time of a test besides its cycles: rest, start, ramps [s]."""

CYCLES = 220
"""Cycles that a test typically takes until it is steady and measured."""


class Pace:
    """Counts tests down by their expected length on the bench."""

    def __init__(self, omegas: tuple[float, ...], tests_per_omega: int) -> None:
        self._total = tests_per_omega * sum(self._expected(omega) for omega in omegas)
        self._finished = 0.0

    @staticmethod
    def _expected(omega: float) -> float:
        return OVERHEAD + CYCLES * tau / omega

    def finished(self, omega: float) -> None:
        """A test at `omega` [rad/s] has its result."""
        self._finished += self._expected(omega)

    def progress(self, activity: str, omega: float | None = None, cycles: int = 0) -> Progress:
        """Where the campaign stands, `cycles` into a test at `omega`."""
        within = 0.0 if omega is None else min(cycles / CYCLES, 0.95) * self._expected(omega)
        gone = min(self._finished + within, self._total)
        return Progress(gone / self._total, self._total - gone, activity)


class HarmonicSheet:
    """One campaign on one bench: what the plan knows and gathers while it runs."""

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
        self._points: list[HarmonicPoint] = []

    def plan(self) -> Generator[Step, Outcome, Sequence[HarmonicPoint]]:
        """The whole campaign as steps; returns its points."""
        calibration = yield from self._bare_frame()
        for beta in self._parameters.beta:
            plans = {omega: self._starts[beta, omega] for omega in self._parameters.omega}
            yield from self._spring(self._specimen.coupled(beta), plans, calibration)
        return self._points

    def _bare_frame(self) -> Generator[Step, Outcome, DriveCalibration]:
        yield Handle(Handwork.REMOVE_BLOCK, self._specimen.bare(), "Take the spring and the block off the table.")
        yield Arm(REST)
        yield Say(StepStarted("calibrate the drive, bare frame"))
        level = self._parameters.calibration_level * self._amplitude
        above = harmonic_frequencies(max(self._parameters.omega), self._parameters.harmonics)
        calibration = yield from calibrate_drive((*self._parameters.omega, *above), level, None)
        if isinstance(calibration, Fallen):
            raise RigError(NO_BLOCK)
        yield Calibrate(calibration)
        duration = self._parameters.ramp_time
        for omega in self._parameters.omega:
            yield Say(StepStarted(f"bare frame at {omega:g} rad/s"))
            yield Follow((Leg(duration, self._amplitude, omega),))
            settled = yield from self._settle(omega, None, calibration)
            if isinstance(settled, Fallen):
                raise RigError(NO_BLOCK)
            if not settled.steadiness.steady:
                yield Say(Warned(f"the bare frame is not steady at {omega:g} rad/s: no gain can be stated there"))
            self._bare[omega] = settled
            self._pace.finished(omega)
            duration = BARE_CHANGE
        yield RampOut()
        return calibration

    def _spring(
        self, specimen: Specimen, plans: Mapping[float, Sequence[Start]], calibration: DriveCalibration
    ) -> Generator[Step, Outcome, None]:
        request = f"Stand the block on its base and mount the spring of beta = {specimen.label:g}."
        yield Handle(Handwork.MOUNT_SPRING, specimen, request)
        yield Arm(REST)
        yield Say(StepStarted(f"calibrate the drive, beta = {specimen.label:g}"))
        starts = [start for each in plans.values() for start in each]
        wanted, level = spring_calibration(self._parameters, specimen, starts)
        measured = yield from calibrate_drive(wanted, level, calibration)
        yield from self._end_test(specimen, fast=isinstance(measured, Fallen))
        if isinstance(measured, DriveCalibration):
            # far above the frame's modes the block adds its mass alone: what the bare frame showed there will do
            calibration = measured.beyond(calibration)
        for omega in self._parameters.omega:
            point = yield from self._point(specimen, omega, calibration, plans[omega])
            self._pace.finished(omega)
            yield Say(self._pace.progress(f"finished beta = {specimen.label:g} at {omega:g} rad/s"))
            self._points.append(point)
            yield Say(PointFinished(point))

    def _point(
        self, specimen: Specimen, omega: float, calibration: DriveCalibration, starts: Sequence[Start]
    ) -> Generator[Step, Outcome, HarmonicPoint]:
        """Try the planned starts; the first steady rocking motion is the point, else the first that stood."""
        found: HarmonicPoint | None = None
        falls = 0
        for tried, start in enumerate(starts, 1):
            where = f"beta = {specimen.label:g} at {omega:g} rad/s, start {tried} of {len(starts)}: {start.name}"
            yield Say(StepStarted(f"{where}, chance {start.chance:.0%}"))
            yield Arm(REST)
            yield Calibrate(calibration)
            settled: Settled | Fallen | None = None
            if not isinstance((yield Follow(start.legs)), Fallen):
                settled = yield from self._settle(omega, specimen, calibration)
            if not isinstance(settled, Settled):
                falls += 1
                yield from self._end_test(specimen, fast=True)
                continue
            yield from self._end_test(specimen, fast=False)
            known, sensors = self._configuration.known_on_table, self._configuration.sensors
            point = judge(settled, self._bare[omega], omega, specimen, known, sensors, tried)
            point = point.model_copy(update={"start_chance": start.chance})
            if point.status is PointStatus.STEADY or not point.predicted_stable:
                return point
            found = found or point
        if found is not None:
            return found.model_copy(update={"starts_tried": len(starts)})
        return self._overturned(specimen, omega, falls, starts[0].chance)

    def _end_test(self, specimen: Specimen, *, fast: bool) -> Generator[Step, Outcome, None]:
        """Ramp out, fast when the block has fallen; a block that has fallen by then is stood up again."""
        outcome = yield RampOut(fast=fast)
        if fast or isinstance(outcome, Fallen):
            yield Handle(Handwork.STAND_BLOCK_UP, specimen, FALLEN_REQUEST)

    def _overturned(self, specimen: Specimen, omega: float, falls: int, chance: float) -> HarmonicPoint:
        bare = self._bare[omega].peak
        layer = predict_gain(specimen, omega, self._amplitude, bare.amplitude).rocking
        kind = "stable" if layer and layer.stable else "unstable"
        return HarmonicPoint(
            omega_rad_s=omega,
            beta=specimen.label or 0.0,
            status=PointStatus.OVERTURNED,
            layer="rocking" if layer else "none",
            alpha_2_predicted=layer.alpha_2 if layer else None,
            alpha_2_predicted_uncertainty=(
                expanded_uncertainty(layer, self._configuration.known_on_table) if layer else None
            ),
            predicted_stable=layer.stable if layer else None,
            bare_drift_peak_m=bare.drift,
            bare_amplitude_m_s2=bare.amplitude,
            starts_tried=falls,
            start_chance=chance,
            reason=f"the block fell in each of {falls} starts; the predicted orbit is {kind}",
        )

    def _settle(
        self, omega: float, specimen: Specimen | None, calibration: DriveCalibration
    ) -> Generator[Step, Outcome, Settled | Fallen]:
        asked = Sine(omega, self._amplitude, calibration)
        return settle_and_measure(asked, self._parameters, self._configuration.analysis, self._look(omega, specimen))

    def _look(self, omega: float, specimen: Specimen | None) -> Look:
        """What the operator is told while a test settles: running alpha_2 beside the predicted one."""
        cycles_seen = 0
        reference = self._bare.get(omega)
        bare = reference.peak if reference else None
        predicted = float("nan")
        if specimen is not None and bare is not None:
            layer = predict_gain(specimen, omega, self._amplitude, bare.amplitude).rocking
            predicted = layer.alpha_2 if layer else predicted

        def look(cycles: list[Cycle]) -> Generator[Step, Outcome, None]:
            nonlocal cycles_seen
            cycles_seen += len(cycles)
            peak = steady_peak(cycles, omega)
            alpha_2 = uncertainty = float("nan")
            if bare is not None and specimen is not None:
                running = gain(peak, bare, self._configuration.sensors)
                alpha_2, uncertainty = running.alpha_2, running.uncertainty
            beta = specimen.label if specimen else None
            yield Say(Estimate(omega, beta, cycles_seen, peak.drift, alpha_2, uncertainty, predicted))
            yield Say(self._pace.progress(f"settling at {omega:g} rad/s", omega, cycles_seen))

        return look
