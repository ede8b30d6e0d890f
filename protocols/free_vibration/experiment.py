"""The free vibration test as a session takes it."""

from collections.abc import Sequence
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Column, Table
from protocols.free_vibration.parameters import FreeVibrationParameters
from protocols.free_vibration.point import DecayPoint
from protocols.free_vibration.sheet import Bench
from sim.identified import Identified
from sim.parameters import Parameters

STILL_LOCKED = "THE TABLE IS STILL LOCKED: take the clamp off before anything is driven."


class FreeVibration:
    """Stiffness and damping of the bare frame, as a file that other runs load."""

    name = "free-vibration"
    figure_name = "free_vibration.png"
    kept_name = "specimen.json"
    point_type: type[Parameters] = DecayPoint

    def __init__(self, parameters: FreeVibrationParameters) -> None:
        self.parameters = parameters
        self._known: Identified | None = None
        self._bench = Bench()

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for a pulse or a pull that this bench cannot make."""
        from protocols.free_vibration.checks import check_pull, check_pulse

        specimen = configuration.known_specimen.bare()
        if self.parameters.excitation == "hand":
            check_pull(self.parameters, configuration)
        else:
            check_pulse(self.parameters, configuration, specimen)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """The most that is asked of every limited quantity."""
        from protocols.free_vibration.preflight import hand_forecast, pulse_forecast
        from protocols.free_vibration.pulse import planned
        from protocols.free_vibration.sheet import expected_duration

        progress("predicting what the run asks of the bench")
        duration = expected_duration(self.parameters, configuration)
        if self.parameters.excitation == "hand":
            return hand_forecast(configuration, self.parameters.pull, duration)
        found = planned(self.parameters, configuration, configuration.known_specimen.bare())
        return pulse_forecast(configuration, {"bare frame": found}, duration)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """The modes as they are assumed."""
        import numpy as np

        from protocols.free_vibration.pulse import frequencies

        frame = configuration.known_specimen.frame
        omega = np.sort(frequencies(configuration.known_specimen.bare()))
        return {
            "omega": Column(omega, "rad/s", "undamped circular frequency of the bare frame"),
            "xi": Column(np.array([frame.xi1, frame.xi2]), "1", "damping ratio"),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.free_vibration.sheet import free_vibration_plan

        self._known, self._bench = configuration.identified, Bench()
        return free_vibration_plan(self.parameters, configuration, self._bench)

    def keep(self, path: Path) -> None:
        """Write what is known of the specimen for other runs, if the frame was identified."""
        from bench.config.specimen_file import write_specimen
        from protocols.free_vibration.told import findings_of

        if self._bench.result is not None:
            known = self._known or Identified()
            write_specimen(path, known.extended(*findings_of(self._bench.result, known)))

    def table(self, points: Sequence[Parameters]) -> str:
        """Every decay, and all of them together; and that the table was left clamped, where it was."""
        from protocols.free_vibration.table import decays_table

        told = decays_table([point for point in points if isinstance(point, DecayPoint)], self._bench.result)
        return f"{told}\n{STILL_LOCKED}" if self._bench.locked else told

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """Decay, residual, spectrum, budget, damping over amplitude."""
        from bench.report.style import write_figure
        from protocols.free_vibration.figure import decay_figure

        write_figure(path, decay_figure(self._bench.result, "bare frame"))
