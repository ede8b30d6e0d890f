"""The simulated rig: the virtual bench with the interface of the hardware."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, VirtualClock
from drivers.computed import ComputedRig
from drivers.further import FurtherChannel
from drivers.rig import Counts, OperatorTask
from drivers.specimen_handling import SpecimenHandling
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

_STILL_VELOCITY = 2.0e-4
"""Velocity of table, storeys and the block's top [m/s] below which the bench is considered at rest."""
_STILL_DISPLACEMENT = 2.0e-4
"""Displacement of the table from mid stroke [m] below which the table is considered at rest."""
_LONGEST_WAIT = 300.0
"""Longest simulated wait for the bench to come to rest [s]; a toppled block held by its strap counts as at rest."""
_WARM_UP = 0.5
"""Settling time of filters and lasers at rest before the sample clock starts [s]."""


class SimulatedRig(ComputedRig):
    """Rig with a simulated bench. With a `VirtualClock` it runs as fast as the machine allows; with a `WallClock` a
    block is returned at the time at which it would have been measured.

    `lead` is the number of drive samples that must be queued beyond a block; the default corresponds to 50 ms. Between
    two runs the bench coasts at zero drive until it is at rest. A part held by hand is released a few seconds after
    sample 0; if the run ends earlier, the part remains held. Every spring is `spring_factor` times as stiff as its
    label.
    """

    def __init__(
        self,
        parameters: VirtualBenchParameters,
        specimen: Specimen,
        *,
        seed: int,
        clock: Clock | None = None,
        lead: int | None = None,
        spring_factor: float = 1.0,
        further: Sequence[FurtherChannel] = (),
    ) -> None:
        self.bench = VirtualBench(parameters, specimen, seed, [each.simulated for each in further])
        shaker, converter, unit = parameters.shaker, parameters.converter, parameters.filter_unit
        super().__init__(
            self.bench.channels,
            parameters.sample_rate,
            shaker.drive_range,
            round(0.05 * parameters.sample_rate) if lead is None else lead,
            clock if clock is not None else VirtualClock(),
            {
                "backend": "simulated",
                "seed": str(seed),
                "shaker": f"simulated, {shaker.moving_mass:g} kg, {shaker.amplifier} amplifier",
                "converter": f"simulated, {converter.bits} bit, +-{converter.range:g} V",
                "filter_unit": f"simulated, Butterworth order {unit.order}, {unit.cutoff:g} Hz",
                **{channel.name: channel.device for channel in self.bench.channels},
            },
        )
        self._handling = SpecimenHandling(specimen, spring_factor)
        self._moved = False

    def begin(self) -> None:
        self._come_to_rest()
        self.bench.run(np.zeros(round(_WARM_UP * self.sample_rate)))
        self.bench.arm()
        self._moved = True

    def respond(self, volts: NDArray[np.float64]) -> Counts:
        return self.bench.run(volts)

    def carry_out(self, work: OperatorTask, amount: float | None) -> None:
        arrangement = self._handling.after(work, amount, self.bench.arrangement)
        self._come_to_rest()
        self.bench.mount(arrangement)

    def _come_to_rest(self) -> None:
        """Coast at zero drive until the bench is at rest, for at most `_LONGEST_WAIT`."""
        # not done by `halt`, which must not wait because it may interrupt a read
        self.bench.disarm()
        waited = 0.0
        while self._moved and waited < _LONGEST_WAIT:
            self.bench.coast(1.0)
            waited += 1.0
            truth = self.bench.truth
            top = 2.0 * self.bench.specimen.block.h_b * truth.omega
            velocity = max(float(np.abs(v).max()) for v in (truth.v, truth.v1, truth.v2, top))
            self._moved = velocity > _STILL_VELOCITY or abs(float(truth.x[-1])) > _STILL_DISPLACEMENT
        self._moved = False
