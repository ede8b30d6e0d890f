"""Free rocking on a bench: the block's restitution, as a specimen file that other runs load."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.config.specimen_file import write_specimen
from bench.preflight.forecast import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from protocols.free_rocking.figure import rocking_figure
from protocols.free_rocking.forecast import check, forecast
from protocols.free_rocking.planned import planned_tilts
from protocols.free_rocking.protocol import FreeRockingParameters, RockingPoint
from protocols.free_rocking.sheet import Bench, free_rocking_plan
from protocols.free_rocking.table import rocking_table
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter
from sim.parameters import Parameters


class FreeRockingTest(Prepared[FreeRockingParameters]):
    """Refuses tilts that the laser cannot follow."""

    def __init__(
        self, parameters: FreeRockingParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        check(parameters, configuration)
        self._bench = Bench()

    @cached_property
    def forecast(self) -> Forecast:
        self.progress("predicting what the run asks of the bench")
        return forecast(self.parameters, self.configuration)

    @cached_property
    def prediction(self) -> Table:
        """The impacts of every tilt, with the specimen as known."""
        specimen = self.configuration.known_specimen
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

    def plan(self) -> Plan:
        self._bench = Bench()
        return self.collected(free_rocking_plan(self.parameters, self.configuration, self._bench))

    def result(self, points: Sequence[Parameters]) -> Result:
        bench, rows = self._bench, [point for point in points if isinstance(point, RockingPoint)]
        left = [
            text
            for there, text in (
                (bench.watching, "Laser 2 still looks at the block: turn it back to storey 2."),
                (bench.locked, "THE TABLE IS STILL LOCKED: take the clamps off before anything is driven."),
            )
            if there
        ]

        def write(path: Path) -> None:
            if bench.identified is not None:
                write_specimen(path, bench.identified)

        def draw(path: Path) -> None:
            write_figure(path, rocking_figure(rows, bench.tilts, bench.found))

        return Result(
            points=tuple(points),
            text="\n".join([rocking_table(rows), *left]),
            figures={"free_rocking.png": draw},
            files={} if bench.identified is None else {"specimen.json": write},
        )
