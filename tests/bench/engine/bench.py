"""A loop-back bench for the tests of the engine: its output is off after every run."""

from bench.engine.engine import Ending
from bench.engine.steps import Plan
from bench.testing.loopback import LoopbackBench

OMEGA = 16.0


class Bench(LoopbackBench):
    """A bench whose output is off after every run."""

    def run(self, plan: Plan) -> Ending:
        ending = super().run(plan)
        assert not self.rig.armed
        return ending

    def ends_at_zero(self) -> bool:
        return self.rig.played.size == 0 or self.rig.played[-1] == 0.0
