"""Long-stroke electrodynamic shaker: moving mass on a soft suspension, moving coil and power amplifier.

    m x'' = Bl i - k_s x - c_s v - F_c tanh(v / v_c) - end stops + force noise - reaction of the specimen

The amplifier either controls the coil voltage e, so that i = (e - Bl v) / R and the back-EMF makes the table nearly a
velocity source, or it controls the current i, which makes the table a force source. The inductance of the coil is
neglected, because it matters only above several hundred hertz. The orders of magnitude follow the data sheets of
long-stroke shakers such as the APS 400 and 420 (445 to 900 N, 0.15 m stroke, 1 m/s).
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.parameters import Parameters, quantity


class Shaker(Parameters):
    """Electrodynamic shaker with its table and its power amplifier."""

    moving_mass: float = quantity(50.0, "kg", "moving mass: armature, table and fixtures, without the specimen", gt=0)
    k_s: float = quantity(500.0, "N/m", "stiffness of the suspension", ge=0)
    c_s: float = quantity(30.0, "N s/m", "viscous damping of the suspension and guides", ge=0)
    bl: float = quantity(50.0, "N/A", "force constant Bl of the moving coil", gt=0)
    resistance: float = quantity(0.8, "ohm", "resistance of the coil", gt=0)
    amplifier: Literal["voltage", "current"] = quantity(
        "voltage", "", "controlled output of the amplifier: coil voltage or current"
    )
    gain: float = quantity(
        3.0, "1", "coil volts (voltage amplifier) or coil amperes (current amplifier) per volt of drive", gt=0
    )
    amplifier_lag: float = quantity(
        0.0, "s", "time constant of a first-order lag of the amplifier; 0 for none", ge=0, usual=(1e-5, 0.02)
    )
    voltage_limit: float = quantity(30.0, "V", "largest coil voltage of the amplifier", gt=0)
    current_limit: float = quantity(18.0, "A", "largest coil current of the amplifier", gt=0)
    drive_range: float = quantity(10.0, "V", "largest magnitude of the drive at the amplifier's input", gt=0)
    friction: float = quantity(1.5, "N", "Coulomb friction F_c of the guides", ge=0)
    friction_velocity: float = quantity(0.004, "m/s", "velocity scale v_c of the friction F_c tanh(v / v_c)", gt=0)
    half_stroke: float = quantity(0.075, "m", "distance from mid stroke to each end stop", gt=0)
    stop_stiffness: float = quantity(4.0e5, "N/m", "stiffness of an end stop", gt=0)
    stop_damping: float = quantity(
        2.0, "s/m", "Hunt-Crossley damping of an end stop: relative increase of its force per m/s of approach", ge=0
    )
    force_noise: float = quantity(0.005, "N/Hz^0.5", "amplitude spectral density of the white force noise", ge=0)
    band_low: float = quantity(1.0, "Hz", "lower end of the usable band", gt=0)
    band_high: float = quantity(100.0, "Hz", "upper end of the usable band", gt=0)

    @property
    def electric_damping(self) -> float:
        """Damping by the back-EMF [N s/m]: (Bl)^2/R with a voltage amplifier, zero with a current amplifier."""
        return self.bl**2 / self.resistance if self.amplifier == "voltage" else 0.0

    @property
    def force_per_volt(self) -> float:
        """Blocked force per volt of drive [N/V]."""
        return self.gain * self.bl / (self.resistance if self.amplifier == "voltage" else 1.0)

    @property
    def shortest_time(self) -> float:
        """Shortest time constant of the shaker [s]: amplifier lag, damped motion, or oscillation on an end stop."""
        motion = self.moving_mass / max(self.c_s + self.electric_damping, 1e-9)
        swing = (self.moving_mass / self.stop_stiffness) ** 0.5
        return min(motion, swing, self.amplifier_lag or motion)

    def frequency_response(self, omega: NDArray[np.float64] | float, payload: float = 0.0) -> NDArray[np.complex128]:
        """Table acceleration per volt of drive [m/s2/V] at `omega` [rad/s], with a rigid `payload` [kg] bolted on.

        This is the linear response, without friction, saturation and end stops; the convention is exp(+i omega t).
        """
        s = 1j * np.asarray(omega, dtype=np.float64)
        impedance = (self.moving_mass + payload) * s * s + (self.c_s + self.electric_damping) * s + self.k_s
        return np.asarray(self.force_per_volt * s * s / (impedance * (1.0 + self.amplifier_lag * s)), np.complex128)

    def drive_for(self, acceleration: float, omega: float, payload: float = 0.0) -> float:
        """Drive amplitude [V] for a sine of amplitude `acceleration` [m/s2] at `omega` [rad/s]; linear response."""
        return acceleration / float(np.abs(self.frequency_response(omega, payload)))
