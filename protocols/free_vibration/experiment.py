"""Free vibration on a bench: stiffness and damping of the bare frame, as a file that other runs load.

1. The block is taken off. By hand: the table is locked, the frame pulled aside before each decay, and let go.
2. By a pulse: the table is probed from a drive too small to do harm up to the drift.
3. Each decay is recorded, fitted, and told; a decay that cannot be used is repeated once.
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
from protocols.common.decays.checks import check_pull, check_pulse
from protocols.common.decays.decays import LETTING_GO, pulsed_decays, pulsed_duration, released_decays, setting_of
from protocols.common.decays.findings import findings_of, impossible
from protocols.common.decays.forecast import hand_forecast, pulse_forecast
from protocols.common.decays.masses import masses_told
from protocols.common.decays.playing import WAITING, Pace
from protocols.common.decays.point import DecayPoint
from protocols.common.decays.pulse import Planned, frequencies, planned, window_of
from protocols.common.decays.results import FrameResult, nonlinear_text, point_of, result_of
from protocols.free_vibration.figure import decay_figure
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.free_vibration.table import decays_table
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
        if parameters.excitation == "hand":
            check_pull(parameters, parameters.pull, configuration)
        else:
            check_pulse(parameters, configuration, self._specimen)
        self._frame: FrameResult | None = None
        self._locked = False
        """Whether the table is clamped."""

    @cached_property
    def pulse(self) -> Planned:
        """The pulse that sets the frame ringing."""
        return planned(self.parameters, self.configuration, self._specimen)

    @property
    def duration(self) -> float:
        """Expected length of the test [s]."""
        p = self.parameters
        if p.excitation == "hand":
            return p.repeats * (LETTING_GO + window_of(p, self._specimen) + WAITING)
        return pulsed_duration(p, self.pulse.pulse)

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting what the run asks of the bench")
        if self.parameters.excitation == "hand":
            return hand_forecast(self.configuration, self.parameters.pull, self.duration)
        return pulse_forecast(self.configuration, {"bare frame": self.pulse}, self.duration)

    @cached_property
    def prediction(self) -> Table:
        """The modes as they are assumed."""
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
        setting, pace = setting_of(p, self.configuration), Pace(self.duration)
        yield from masses_told(self.configuration)
        yield Handle(Handwork.REMOVE_BLOCK, specimen, "Take the spring and the block off the table.")
        if p.excitation == "hand":
            decays = yield from self._locked_decays(specimen, setting, pace)
        else:
            decays = yield from pulsed_decays(p, self.configuration, self.pulse, setting, pace, "free vibration")
        found = self._frame = result_of(decays, setting.masses, setting.weighed)
        if found.nonlinear.any():
            yield Say(Warned(nonlinear_text(found)))
        yield Say(PointFinished(point_of(found, 0)))
        if (left_out := impossible(found)) is not None:
            yield Say(Warned(left_out))
        known = self.configuration.identified or Identified()
        yield Say(SpecimenIdentified(known.extended(*findings_of(found, known))))

    def result(self, points: Sequence[Parameters]) -> Result:
        found, known = self._frame, self.configuration.identified or Identified()

        def write(path: Path) -> None:
            if found is not None:
                write_specimen(path, known.extended(*findings_of(found, known)))

        told = decays_table([point for point in points if isinstance(point, DecayPoint)], found)
        return Result(
            points=tuple(points),
            text=f"{told}\n{STILL_LOCKED}" if self._locked else told,
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
            decays = yield from released_decays(self.parameters, self.parameters.pull, specimen, setting, pace)
        except RockbenchError as error:
            failed = error
        yield Handle(Handwork.UNLOCK_TABLE, specimen, "Take the clamp off the table.")
        self._locked = False
        if failed is not None:
            raise failed
        return decays
