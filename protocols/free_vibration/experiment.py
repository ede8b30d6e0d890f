"""Free vibration on a bench: stiffness and damping of the bare frame, as a file that other runs load.

1. The block is taken off. By hand: the table is locked, the frame pulled aside before each decay, and let go.
2. By a pulse: the table is probed from a drive too small to do harm up to the drift.
3. Each decay is recorded, fitted, and published; a decay that cannot be used is repeated once.
4. All decays together make the result.
"""

from collections.abc import Generator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.free_decay.decay import Decay, Setting
from bench.config.model import BenchConfiguration
from bench.config.specimen_file import write_specimen
from bench.engine.steps import Handle, Outcome, Say, Step
from bench.events import PointFinished, SpecimenIdentified, Warned
from bench.preflight.forecast import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from drivers.rig import Handwork
from protocols.common.decays.decays import fit_setting, pulsed_decays, pulsed_duration
from protocols.common.decays.findings import check_masses, frame_findings, impossible_values, mass_warning
from protocols.common.decays.frame import FrameResult, decay_point, frame_result, nonlinear_text
from protocols.common.decays.parameters import DecayPoint
from protocols.common.decays.pulse import PlannedPulse, frequencies, plan_pulse, pulse_forecast
from protocols.common.decays.recording import Pace
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.free_vibration.release import check_pull, hand_forecast, release_duration, released_decays
from protocols.free_vibration.results import decay_figure, decays_table
from sim.errors import RockbenchError
from sim.identified import Identified
from sim.parameters import Parameters
from sim.specimen import Specimen

LOCK = "Clamp the table to the ground: it must not move, and it is not driven."

STILL_LOCKED = "THE TABLE IS STILL LOCKED: take the clamp off before anything is driven."


class FreeVibration(Prepared[FreeVibrationParameters]):
    """Refuses a pulse or a pull that this bench cannot make."""

    def __init__(
        self, parameters: FreeVibrationParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._specimen = configuration.known_specimen.bare()
        check_masses(parameters, configuration)
        self._pulse: PlannedPulse | None = None
        """The pulse that sets the frame ringing; None where it is released by hand."""
        if parameters.excitation == "hand":
            check_pull(parameters, configuration)
            self._duration = release_duration(parameters, self._specimen)
        else:
            self._pulse = plan_pulse(parameters, configuration, self._specimen)
            self._duration = pulsed_duration(parameters, self._pulse.pulse)
        self._frame: FrameResult | None = None
        self._locked = False
        """True while the table is clamped."""

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting what the run asks of the bench")
        if self._pulse is None:
            return hand_forecast(self.configuration, self.parameters.pull, self._duration)
        return pulse_forecast(self.configuration, {"bare frame": self._pulse}, self._duration)

    @cached_property
    def prediction(self) -> Table:
        """The assumed modes."""
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
        yield Handle(Handwork.REMOVE_BLOCK, specimen, "Take the spring and the block off the table.")
        if self._pulse is None:
            decays = yield from self._locked_decays(specimen, setting, pace)
        else:
            decays = yield from pulsed_decays(p, self.configuration, self._pulse, setting, pace, "free vibration")
        found = self._frame = frame_result(decays, setting.masses, setting.weighed)
        if found.nonlinear.any():
            yield Say(Warned(nonlinear_text(found)))
        yield Say(PointFinished(decay_point(found, 0)))
        if (left_out := impossible_values(found)) is not None:
            yield Say(Warned(left_out))
        known = self.configuration.identified or Identified()
        yield Say(SpecimenIdentified(known.extended(*frame_findings(found, known))))

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
        """Decays on a table that is clamped for them, and not left so where they cannot be used."""
        self._locked = True
        yield Handle(Handwork.LOCK_TABLE, specimen, LOCK)
        decays: list[Decay] = []
        failed: RockbenchError | None = None
        try:
            decays = yield from released_decays(self.parameters, specimen, setting, pace)
        except RockbenchError as error:
            failed = error
        yield Handle(Handwork.UNLOCK_TABLE, specimen, "Take the clamp off the table.")
        self._locked = False
        if failed is not None:
            raise failed
        return decays
