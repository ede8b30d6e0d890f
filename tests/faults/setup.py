"""The bench and the campaign that faults are put into: small and quick, with every part that a real one has."""

from dataclasses import dataclass

from bench.control.oscillator import DriveCalibration
from bench.guard.limits import Debounce, Limits, Ramps
from bench.guard.shaker import ShakerModel
from sim.parameters import Parameters, quantity
from sim.shaker import Shaker
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE = 1000.0
BLOCK, LEAD = 100, 50
OMEGA, AMPLITUDE = 25.0, 1.0
"""The drive of both tests: circular frequency [rad/s] and table acceleration [m/s2], below uplift."""

# a stiff suspension and damped storeys come to rest within a second or two: most of the time would go there
SHAKER = Shaker(k_s=20_000.0)
BARE = Specimen(frame=Frame(xi1=0.5, xi2=0.5))
COUPLED = BARE.coupled(0.4)
PARAMETERS = VirtualBenchParameters(sample_rate=RATE, shaker=SHAKER)
GAIN = float(abs(SHAKER.frequency_response(OMEGA)))
CALIBRATION = DriveCalibration.flat(GAIN)

LIMITS = Limits(
    drive_voltage=3.0,
    displacement=0.005,
    velocity=0.09,
    acceleration=1.9,
    sensor_loss=0.2,
    stuck=0.3,
    late=0.3,
    debounce=Debounce(displacement=0.003, velocity=0.003, acceleration=0.003),
)
RAMPS = Ramps(stop=0.35, abort=0.2)
MOVER = ShakerModel(mass=SHAKER.moving_mass + 4.6, stiffness=SHAKER.k_s, force_constant=SHAKER.bl)


@dataclass(frozen=True)
class Setting:
    """A campaign of two tests: its clock [1/s, samples], its drive, and what is allowed.

    Each test rests for `rest` seconds, goes in `glide` seconds to `amplitude` [m/s2] at `omega` [rad/s], and dwells
    there.
    """

    rate: float = RATE
    block: int = BLOCK
    lead: int = LEAD
    omega: float = OMEGA
    amplitude: float = AMPLITUDE
    calibration: DriveCalibration = CALIBRATION
    rest: float = 0.2
    glide: float = 0.25
    limits: Limits = LIMITS
    ramps: Ramps = RAMPS


class NoPoint(Parameters):
    """The result of a campaign that has none."""

    value: float = quantity(0.0, "1", "nothing")
