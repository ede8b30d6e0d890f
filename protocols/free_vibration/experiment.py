"""Identification of stiffness and damping of the bare frame from free vibration, written to a specimen file for other
runs.

1. The block is removed.
2. For releases by hand, the table is locked, and storey 2 is displaced and released for each decay. For pulses, the
   drive is increased from probe to probe, from 0.02 V to the level that gives the requested drift or reaches a limit.
3. Each decay is recorded, fitted and published; an unusable decay is repeated once.
4. The result combines all decays.
"""

from collections.abc import Generator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.free_decay.decay import Decay, Setting, released_decay
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_specimen
from bench.datafile.tables import Column, Table
from bench.engine.steps import OperatorAction, Outcome, Publish, Step
from bench.events import PointFinished, Warned
from bench.figures.style import write_figure
from bench.findings import SpecimenIdentified
from bench.preflight.demands import demands_of
from bench.preflight.margins import Forecast, bounds
from bench.preflight.motion import laser_demands
from bench.protocol import Plan, Prepared, Result, Sources
from drivers.rig import OperatorTask
from protocols.common.decays.findings import check_masses, frame_findings, impossible_values, mass_warning
from protocols.common.decays.frame import FrameResult, decay_point, frame_result, nonlinear_text
from protocols.common.decays.parameters import DecayPoint
from protocols.common.decays.pulse import (
    LEAST,
    SHARE,
    PlannedPulse,
    decay_window,
    frequencies,
    plan_pulse,
    pulse_forecast,
)
from protocols.common.decays.recording import (
    BY_HAND,
    WAITING,
    Pace,
    fit_setting,
    pulsed_decays,
    pulsed_duration,
    record,
    repeat_decays,
)
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.free_vibration.results import decay_figure, decays_table
from sim.errors import InvalidInput, RockbenchError
from sim.identified import Identified
from sim.parameters import Parameters
from sim.specimen import Specimen

RELEASE = 6.0
"""Time from the start of the recording within which the frame must be released by hand [s]."""


LOCK = "Clamp the table to the ground so that it cannot move. The table is not driven while it is clamped."

STILL_LOCKED = "THE TABLE IS STILL LOCKED: remove the clamp before the table is driven."


class FreeVibration(Prepared[FreeVibrationParameters]):
    """Identification of the frame. Raises InvalidInput for a pulse or an initial displacement outside the limits of the
    bench, or for a mass uncertainty other than the default if the specimen file contains the masses.
    """

    def __init__(
        self, parameters: FreeVibrationParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._specimen = configuration.known_specimen.bare()
        check_masses(parameters, configuration)
        self._pulse: PlannedPulse | None = None
        """Excitation pulse; None for a release by hand."""
        if parameters.excitation == "hand":
            _check_pull(parameters, configuration)
            self._duration = _release_duration(parameters, self._specimen)
        else:
            self._pulse = plan_pulse(parameters, configuration, self._specimen)
            self._duration = pulsed_duration(parameters, self._pulse.pulse)
        self._frame: FrameResult | None = None
        self._locked = False
        """Whether the table is clamped."""

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting the demands of the run")
        if self._pulse is None:
            return _release_forecast(self.configuration, self.parameters.pull, self._duration)
        return pulse_forecast(self.configuration, {"bare frame": self._pulse}, self._duration)

    @cached_property
    def prediction(self) -> Table:
        """Predicted modes of the bare frame, one row per mode."""
        frame = self.configuration.known_specimen.frame
        omega = np.sort(frequencies(self._specimen))
        return {
            "omega": Column(omega, "rad/s", "undamped circular frequency of the bare frame"),
            "xi": Column(np.array([frame.xi1, frame.xi2]), "1", "damping ratio"),
        }

    def plan(self) -> Plan:
        self._frame, self._locked = None, False
        return self.collected(self._steps())

    def _steps(self) -> Generator[Step, Outcome, None]:
        p, specimen = self.parameters, self._specimen
        setting, pace = fit_setting(p, self.configuration), Pace(self._duration)
        yield from mass_warning(self.configuration)
        yield OperatorAction(OperatorTask.REMOVE_BLOCK, specimen, "Remove the spring and the block from the table.")
        if self._pulse is None:
            decays = yield from self._locked_decays(specimen, setting, pace)
        else:
            decays = yield from pulsed_decays(p, self.configuration, self._pulse, setting, pace, "free vibration")
        found = self._frame = frame_result(decays, setting.masses, setting.masses_covariance)
        if found.nonlinear.any():
            yield Publish(Warned(nonlinear_text(found)))
        yield Publish(PointFinished(decay_point(found, 0)))
        if (left_out := impossible_values(found)) is not None:
            yield Publish(Warned(left_out))
        known = self.configuration.identified or Identified()
        yield Publish(SpecimenIdentified(known.extended(*frame_findings(found, known))))

    def result(self, points: Sequence[Parameters]) -> Result:
        found, known = self._frame, self.configuration.identified or Identified()

        def write(path: Path) -> None:
            if found is not None:
                write_specimen(path, known.extended(*frame_findings(found, known)))

        text = decays_table([point for point in points if isinstance(point, DecayPoint)], found)
        return Result(
            points=tuple(points),
            text=f"{text}\n{STILL_LOCKED}" if self._locked else text,
            figures={"free_vibration.png": lambda path: write_figure(path, decay_figure(found, "bare frame"))},
            files={} if found is None else {"specimen.json": write},
        )

    def _locked_decays(self, specimen: Specimen, setting: Setting, pace: Pace) -> Generator[Step, Outcome, list[Decay]]:
        """Decays with the table clamped; the clamp is removed even if the decays are unusable."""
        self._locked = True
        yield OperatorAction(OperatorTask.LOCK_TABLE, specimen, LOCK)
        decays: list[Decay] = []
        failed: RockbenchError | None = None
        try:
            decays = yield from _released_decays(self.parameters, specimen, setting, pace)
        except RockbenchError as error:
            failed = error
        yield OperatorAction(OperatorTask.UNLOCK_TABLE, specimen, "Remove the clamp from the table.")
        self._locked = False
        if failed is not None:
            raise failed
        return decays


def _check_pull(parameters: FreeVibrationParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput for an initial displacement that is too large for the lasers or the drift limit, or too small
    to measure.
    """
    # a storey may swing to the opposite side, by up to twice the initial displacement from where it was released
    room = min(
        SHARE * 0.5 * configuration.limits.drift,
        *(0.5 * SHARE * min(configuration.limits.laser_range, 1.0) * half for half in configuration.laser_half_ranges),
    )
    if not LEAST <= parameters.pull <= room:
        allowed = (
            f"it must be {LEAST:g} to {room:.3g} m, as limited by limits.drift, limits.laser_range and the lasers' "
            "measuring ranges"
        )
        raise InvalidInput("pull", parameters.pull, allowed)


def _release_forecast(configuration: BenchConfiguration, pull: float, duration: float) -> Forecast:
    """Demands of releases by hand, without drive. Twice the initial displacement of storey 2 is an upper bound of the
    displacements of both storeys and of the drift.
    """
    swing = 2.0 * pull
    moved = dict.fromkeys(bounds(configuration), 0.0)
    moved |= laser_demands(swing, swing, swing, configuration.laser_half_ranges)
    where = "release of storey 2 on a locked table"
    return Forecast(demands=demands_of(moved, where, configuration), duration=duration)


def _release_duration(parameters: FreeVibrationParameters, specimen: Specimen) -> float:
    """Expected duration of the decays after releases by hand [s]."""
    return parameters.repeats * (RELEASE + decay_window(parameters, specimen) + WAITING)


def _released_decays(
    parameters: FreeVibrationParameters, specimen: Specimen, setting: Setting, pace: Pace
) -> Generator[Step, Outcome, list[Decay]]:
    """Decays after releases by hand. Raises Unmeasurable if none is usable."""
    pull, window = parameters.pull, decay_window(parameters, specimen)
    silence = np.zeros(round((RELEASE + window) * setting.sample_rate))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        request = (
            f"Displace storey 2 by {1e3 * pull:g} mm without touching storey 1, and hold it. As soon as the recording "
            "has begun, release it without a push."
        )
        yield OperatorAction(OperatorTask.PULL_FRAME, specimen, request, pull)
        signals = yield from record(silence, setting.sample_rate, pace, activity, BY_HAND)
        return released_decay(signals, setting)

    how = f"release by hand, decay of {window:.0f} s"
    planned = RELEASE + window + WAITING
    return (yield from repeat_decays(parameters, setting, pace, planned, once, "free vibration", how))
