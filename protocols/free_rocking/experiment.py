"""Free rocking on a bench: limits of laser and filters, forecast, prediction and result."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.free_rocking.points import AFTER
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_specimen
from bench.datafile.tables import Column, Table
from bench.figures.style import write_figure
from bench.preflight.margins import Demand, Forecast, bounds
from bench.protocol import Plan, Prepared, Result, Sources
from protocols.free_rocking.plan import RockingRun, beam_heights, planned_tilts
from protocols.free_rocking.protocol import FreeRockingParameters, RockingPoint
from protocols.free_rocking.results import rocking_figure, rocking_table
from sim.channel import STOREYS
from sim.errors import InvalidInput
from sim.free_rocking import FreeRocking, critical_angle, frequency_parameter
from sim.parameters import Parameters

LOWEST_CUTOFF = 1.25 / AFTER
"""Cutoff [Hz] of a fourth-order Butterworth low-pass that leaves 5 % of the kink due to an impact, about 2 um, `AFTER`
seconds after the impact.
"""

_MEETS = (
    "the laser beam misses the face of the tilted block: choose a height between {:.4f} and {:.4f} m for these tilts"
)

_NOT_WATCHED = "laser 2 measures the block, so the drift is neither measured nor monitored"

_LASER_ON_BLOCK = "Laser 2 still points at the block: aim it at storey 2 again."

_TABLE_LOCKED = "THE TABLE IS STILL LOCKED: remove the clamps before the table is driven."


class FreeRockingTest(Prepared[FreeRockingParameters]):
    """Identification of the block's restitution. Raises InvalidInput for tilts that the laser cannot measure."""

    def __init__(
        self, parameters: FreeRockingParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self.tilts = planned_tilts(parameters, configuration.specimen)
        self._check()
        self._run = RockingRun(parameters, configuration, self.tilts)

    @cached_property
    def forecast(self) -> Forecast:
        """Duration and demands: only the range of laser 2 is used; the drive remains zero."""
        self.progress("predicting the demands of the run")
        largest = max(abs(tilt.displacement) for tilt in self.tilts)
        where = f"{1e3 * largest:.0f} mm of displacement of the block's face"
        demands: list[Demand] = []
        for quantity in bounds(self.configuration):
            if quantity == STOREYS[1]:
                demands.append(Demand(quantity, largest / self.configuration.laser_half_ranges[1], None, where))
            elif quantity == "drift":
                demands.append(Demand(quantity, None, None, _NOT_WATCHED))
            else:
                demands.append(Demand(quantity, 0.0, None, "the table is not driven"))
        return Forecast(
            demands=tuple(demands),
            duration=sum(tilt.duration for tilt in self.tilts),
            notes=("The drive remains zero. The operator locks the table at the start and unlocks it at the end.",),
        )

    @cached_property
    def prediction(self) -> Table:
        """Predicted impacts of each tilt for the nominal specimen."""
        specimen = self.configuration.known_specimen
        alpha, p = critical_angle(specimen.block), frequency_parameter(specimen.block, specimen.g)
        motions = [FreeRocking(alpha, p, specimen.block.restitution, tilt.angle) for tilt in self.tilts]
        used = [
            int(np.count_nonzero(motion.amplitudes > self.parameters.least_swing * abs(motion.tilt)))
            for motion in motions
        ]
        pairs = list(zip(motions, used, strict=True))
        return {
            "tilt": Column(np.concatenate([np.full(n, m.tilt) for m, n in pairs]), "rad", "tilt before the release"),
            "impact": Column(np.concatenate([m.impacts[:n] for m, n in pairs]), "s", "time since the release"),
            "angle": Column(
                np.concatenate([(m.sides * m.amplitudes)[:n] for m, n in pairs]),
                "rad",
                "largest angle before the impact",
            ),
        }

    def plan(self) -> Plan:
        self._run = RockingRun(self.parameters, self.configuration, self.tilts)
        return self.collected(self._run.steps())

    def result(self, points: Sequence[Parameters]) -> Result:
        run, rows = self._run, [point for point in points if isinstance(point, RockingPoint)]
        lines = [rocking_table(rows)]
        if run.laser_on_block:
            lines.append(_LASER_ON_BLOCK)
        if run.table_locked:
            lines.append(_TABLE_LOCKED)

        def write(path: Path) -> None:
            if run.identified is not None:
                write_specimen(path, run.identified)

        return Result(
            points=tuple(points),
            text="\n".join(lines),
            figures={
                "free_rocking.png": lambda path: write_figure(path, rocking_figure(rows, run.tilts, run.findings))
            },
            files={} if run.identified is None else {"specimen.json": write},
        )

    def _check(self) -> None:
        """Raise InvalidInput if the laser cannot measure the block's motion, or the simulated filters are too slow."""
        p, configuration = self.parameters, self.configuration
        low, high = beam_heights(self.tilts, configuration.specimen)
        for tilt in self.tilts:
            if tilt.displacement != tilt.displacement:
                raise InvalidInput("height", p.height, _MEETS.format(low, high))
            share = abs(tilt.displacement) / configuration.laser_half_ranges[1]
            allowed = configuration.limits.laser_range
            if share > allowed:
                needs = (
                    f"the face moves by {1e3 * abs(tilt.displacement):.1f} mm at this height, {share:.2f} times "
                    "half the range"
                )
                raise InvalidInput(
                    "height", p.height, f"{needs} of laser 2, but limits.laser_range = {allowed:g}: aim lower"
                )
        if configuration.backend == "simulated":
            cutoff = configuration.simulation.bench.filter_unit.cutoff
            if cutoff < LOWEST_CUTOFF:
                allowed = (
                    f"it must be at least {LOWEST_CUTOFF:g} Hz, so that the effect of impacts decays within "
                    f"{1e3 * AFTER:.0f} ms"
                )
                raise InvalidInput("simulation.bench.filter_unit.cutoff", cutoff, allowed)
