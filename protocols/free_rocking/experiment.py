"""Free rocking as a session takes it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Column, Table
from protocols.free_rocking.parameters import FreeRockingParameters
from protocols.free_rocking.point import RockingPoint
from protocols.free_rocking.sheet import Bench, free_rocking_plan
from sim.parameters import Parameters


class FreeRockingTest:
    """The block's restitution, as a specimen file that other runs load."""

    name = "free-rocking"
    figure_name = "free_rocking.png"
    kept_name = "specimen.json"
    point_type: type[Parameters] = RockingPoint

    def __init__(self, parameters: FreeRockingParameters) -> None:
        self.parameters = parameters
        self._bench = Bench()

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput where the laser cannot follow the block."""
        from protocols.free_rocking.preflight import check

        check(self.parameters, configuration)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """No drive; the laser's share of its range; how long it takes."""
        from protocols.free_rocking.preflight import forecast

        progress("predicting what the run asks of the bench")
        return forecast(self.parameters, configuration)

    def predict(self, configuration: BenchConfiguration) -> Table:
        """The half swings of each tilt for the specimen as known."""
        from protocols.free_rocking.planned import planned_tilts
        from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter

        specimen = configuration.known_specimen
        alpha, p = critical_angle(specimen.block), frequency_parameter(specimen.block, specimen.g)
        tilts = planned_tilts(self.parameters, specimen)
        motions = [FreeRocking(alpha, p, specimen.block.restitution, tilt) for tilt in tilts]
        used = [
            int(np.count_nonzero(motion.amplitudes > self.parameters.least_swing * abs(motion.tilt)))
            for motion in motions
        ]
        pairs = list(zip(motions, used, strict=True))
        return {
            "tilt": Column(np.concatenate([np.full(n, m.tilt) for m, n in pairs]), "rad", "tilt that is let go"),
            "impact": Column(np.concatenate([m.impacts[:n] for m, n in pairs]), "s", "instant since the release"),
            "angle": Column(
                np.concatenate([(m.sides * m.amplitudes)[:n] for m, n in pairs]), "rad", "largest angle before"
            ),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        self._bench = Bench()
        return free_rocking_plan(self.parameters, configuration, self._bench)

    def keep(self, path: Path) -> None:
        """Write what is known of the specimen with the restitution that was found, if it was."""
        from bench.config.specimen_file import write_specimen

        if self._bench.identified is not None:
            write_specimen(path, self._bench.identified)

    def table(self, points: Sequence[Parameters]) -> str:
        """The tilts and what they come to; and what may be left to be undone at the bench."""
        from protocols.free_rocking.table import rocking_table

        left = [
            text
            for there, text in (
                (self._bench.watching, "Laser 2 still looks at the block: turn it back to storey 2."),
                (self._bench.locked, "THE TABLE IS STILL LOCKED: take the clamps off before anything is driven."),
            )
            if there
        ]
        return "\n".join([rocking_table(_rows(points)), *left])

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """Motion with fit, single impacts, parts of the uncertainty."""
        from bench.report.style import write_figure
        from protocols.free_rocking.figure import rocking_figure

        write_figure(path, rocking_figure(_rows(points), self._bench.tilts, self._bench.found))


def _rows(points: Sequence[Parameters]) -> list[RockingPoint]:
    return [point for point in points if isinstance(point, RockingPoint)]
