"""One short run of every protocol in virtual time, as the messages of its session, with the state of the simulated
bench at each of them: tests of the Run page share these instead of starting sessions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bench.app.catalogue import load_protocol
from bench.app.ipc.broadcast import Reduction
from bench.app.ipc.messages import FromSession, Opened, Published, Run, Traces
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.engine.engine import configured_engine
from bench.engine.interface import EventStream, Requests, Unattended
from bench.events import Acquired, Event, ValuesReceived
from drivers.clock import VirtualClock
from drivers.simulated import SimulatedRig
from protocols.check.protocol import CheckParameters
from protocols.common.identification.parameters import IdentifyParameters
from protocols.coupling_stiffness.protocol import CouplingStiffnessParameters
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.free_rocking.protocol import FreeRockingParameters
from protocols.free_vibration.protocol import FreeVibrationParameters
from protocols.harmonic.protocol import HarmonicParameters
from protocols.laser_calibration.protocol import LaserCalibrationParameters
from protocols.stability.protocol import StabilityParameters
from sim.arrangement import Arrangement
from sim.parameters import Parameters
from sim.virtual_bench import VirtualBenchParameters

PARAMETERS: dict[str, Parameters] = {
    "check": CheckParameters(cycles=4, rest=0.5),
    "laser-calibration": LaserCalibrationParameters(passes=6, cycles=4),
    "identify": IdentifyParameters(period=2.0, realisations=2, periods=2, discarded=1),
    "free-vibration": FreeVibrationParameters(repeats=1, window=5.0),
    "coupling-stiffness": CouplingStiffnessParameters(beta=(0.4,), repeats=1, window=5.0),
    "free-rocking": FreeRockingParameters(tilts=(0.35,)),
    "harmonic": HarmonicParameters(
        omega=(20.0,),
        beta=(0.25,),
        measured_cycles=4,
        starts=1,
        ramp_time=2.0,
        settle_tolerance=0.02,
        amplitude_tolerance=0.02,
        harmonics=1,
        distortion_tolerance=0.1,
    ),
    "earthquake": EarthquakeParameters(records=("synthetic:kobe",), beta=(0.97,), draws=40, passes=1, longest=5.0),
    "stability": StabilityParameters(omega=(15.3,), released_cycles=24, bisect=False, starts=1),
}


def _bench(name: str) -> VirtualBenchParameters:
    """Few samples per second, as many as the protocol needs."""
    if name == "stability":
        return VirtualBenchParameters(sample_rate=500.0)
    rate, cutoff = (200.0, 50.0) if name == "free-rocking" else (125.0, 30.0)
    return VirtualBenchParameters.model_validate(
        {"sample_rate": rate, "filter_unit": {"cutoff": cutoff}, "shaker": {"band_high": 20.0}}
    )


@dataclass(frozen=True, eq=False)
class Moment:
    """A message of the session, and the simulated bench when it was sent."""

    message: FromSession
    bench: Arrangement


@dataclass(frozen=True, eq=False)
class ShortRun:
    """The order of a run, and all messages of its session in order."""

    run: Run
    moments: Sequence[Moment]


@cache
def short_run(name: str) -> ShortRun:
    """Carry out the protocol on a simulated bench; raises AssertionError unless the run is completed."""
    simulation = Simulation(bench=_bench(name), seed=3)
    # in few blocks, but for the protocol whose corrections must come within a cycle
    acquisition = Acquisition() if name == "stability" else Acquisition(block_duration=0.2, lead=0.2)
    configuration = BenchConfiguration(simulation=simulation, acquisition=acquisition)
    protocol = load_protocol(name)
    prepared = protocol.prepare(PARAMETERS[name], configuration, None)
    rig = SimulatedRig(
        simulation.bench,
        configuration.specimen,
        seed=simulation.seed,
        clock=VirtualClock(),
        lead=configuration.lead_samples,
    )
    names = tuple(channel.name for channel in rig.channels)
    moments = [Moment(Opened(names, rig.sample_rate, {}, prediction=prepared.prediction), rig.bench.arrangement)]
    reduced: Callable[[Acquired], Traces] = Reduction(rig.sample_rate)

    def keep(event: Event) -> None:
        if not isinstance(event, ValuesReceived):
            message = reduced(event) if isinstance(event, Acquired) else Published(event)
            moments.append(Moment(message, rig.bench.arrangement))

    requests = Requests()
    engine = configured_engine(rig, configuration, EventStream(rig.clock, [keep]), requests, Unattended())
    ending = engine.run(prepared.plan())
    assert ending.status == "completed", ending.reason
    rig.close()
    return ShortRun(Run(name, PARAMETERS[name], configuration, Path("never")), moments)
