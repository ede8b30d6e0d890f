"""The configuration of a bench: what stands in the laboratory, as opposed to what a protocol asks for."""

from typing import Literal

from pydantic import model_validator

from bench.analysis.gain import SensorAccuracy
from bench.guard.limits import Limits, Ramps
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters


class Acquisition(Parameters):
    """How the samples travel."""

    block_duration: float = quantity(
        0.1, "s", "length of a block of samples: one turn of the loop that reads, guards and drives", ge=0.01, le=0.2
    )


class Simulation(Parameters):
    """The virtual bench that the simulated backend runs on."""

    seed: int = quantity(1, "", "seed of every random number of the virtual bench", ge=0, lt=2**32)
    bench: VirtualBenchParameters = VirtualBenchParameters()
    specimen: Specimen | None = quantity(None, "", "the true specimen; absent when it is as assumed")
    spring_factor: float = quantity(
        1.0, "1", "true over nominal stiffness of every spring that is mounted", gt=0, le=10
    )


class BenchConfiguration(Parameters):
    """Everything that describes a bench. The defaults are the paper's specimen on the simulated bench."""

    backend: Literal["simulated"] = quantity("simulated", "", "what drives and reads the bench")
    specimen: Specimen = Specimen()
    limits: Limits = Limits()
    ramps: Ramps = Ramps()
    acquisition: Acquisition = Acquisition()
    analysis: SensorAccuracy = SensorAccuracy()
    simulation: Simulation = Simulation()

    @model_validator(mode="after")
    def _springs_belong_to_the_protocol(self) -> "BenchConfiguration":
        for name, specimen in (("specimen", self.specimen), ("simulation.specimen", self.simulation.specimen)):
            if specimen is not None and specimen.beta is not None:
                allowed = "the protocol says which springs are mounted; leave it out (see simulation.spring_factor)"
                raise InvalidInput(f"{name}.beta", specimen.beta, allowed)
        return self
