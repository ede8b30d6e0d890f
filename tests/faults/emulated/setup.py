"""The campaign that faults are put into in real time: under three seconds, most of which is waiting."""

from dataclasses import replace
from typing import Any

from bench.control.oscillator import DriveCalibration
from bench.guard.limits import Ramps
from drivers.emulation.laboratory import Laboratory
from drivers.emulation.safety_chain import PulseRelay
from drivers.hardware.parameters import Hardware
from tests.faults.places import PLACES as SIMULATED
from tests.faults.places import Place
from tests.faults.setup import LIMITS, SHAKER, Setting

OMEGA = 50.0
SETTING = Setting(
    block=50,
    lead=300,
    omega=OMEGA,
    calibration=DriveCalibration.flat(float(abs(SHAKER.frequency_response(OMEGA)))),
    rest=0.1,
    glide=0.15,
    limits=LIMITS.model_copy(update={"sensor_loss": 0.3, "stuck": 0.35, "late": 0.25}),
    ramps=Ramps(stop=0.3, abort=0.15),
)
KEEPER = 0.8
"""Time-out of whatever opens the enable chain by itself: the device's watchdog, the relay of the heartbeat [s]."""
PATIENCE = 1.0
"""How long a call to the device server may take beyond its own duration [s]."""
LISTENING = 1.0
"""How long the serial lasers are listened to before the first run [s]: with less their clocks are not known."""

_TURNS = {
    "following": 8,
    "dwelling": 11,
    "half stopped": 9,
    "running again": 11,
    "half aborted": 8,
    "stop asked for": 8,
    "abort asked for": 7,
}
"""The lead is six blocks here: what a place is called happens at the output so much later."""
PLACES: tuple[Place, ...] = tuple(
    replace(place, turn=_TURNS.get(place.name, place.turn), asked_in=11) for place in SIMULATED
)


def shortened(laboratory: Laboratory, *, watchdog: bool = True, heartbeat: bool = True) -> Hardware:
    """The configuration of a client with less patience than a person's bench has.

    Without `heartbeat` its relay is bridged, as where there is none.
    """
    hardware = laboratory.hardware
    relay: Any = PulseRelay(KEEPER) if heartbeat else Bridge()
    laboratory.safety._pulses = relay  # pyright: ignore[reportPrivateUsage]
    daq, lasers = hardware.daq, hardware.lasers
    beating = daq.heartbeat.model_copy(update={"timeout": KEEPER}) if daq.heartbeat and heartbeat else None
    keepers = {"watchdog": KEEPER if watchdog else None, "heartbeat": beating}
    return hardware.model_copy(
        update={
            "daq": daq.model_copy(update={**keepers, "timeout_margin": PATIENCE}),
            "lasers": lasers.model_copy(update={"observation_time": LISTENING, "rate": 1000.0}),
        }
    )


class Bridge:
    """A piece of wire in the place of a relay."""

    closed = True

    def level(self, high: bool) -> None:
        """Nothing comes of it."""
