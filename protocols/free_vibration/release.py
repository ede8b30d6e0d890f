"""Release of the frame by hand on a locked table: limits, forecast, decays."""

from collections.abc import Generator

import numpy as np

from bench.analysis.free_decay.decay import Decay, Setting, released_decay
from bench.config.model import BenchConfiguration
from bench.engine.steps import Handle, Outcome, Step
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from drivers.rig import Handwork
from protocols.common.decays.decays import repeat_decays
from protocols.common.decays.pulse import LEAST, SHARE, decay_window
from protocols.common.decays.recording import WAITING, Pace, record
from protocols.free_vibration.protocol import FreeVibrationParameters
from sim.errors import InvalidInput
from sim.specimen import Specimen

RELEASE = 6.0
"""Time within which the frame is let go by hand [s]."""


def check_pull(parameters: FreeVibrationParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput for a pull that leaves the lasers' range or the drift's limit, or that they hardly measure."""
    # the storeys swing to the other side of where they are held
    room = min(
        SHARE * 0.5 * configuration.limits.drift,
        *(SHARE * 0.5 * min(configuration.limits.laser_range, 1.0) * 0.5 * each for each in configuration.laser_ranges),
    )
    if not LEAST <= parameters.pull <= room:
        allowed = f"{LEAST:g} to {room:.3g} m: limits.drift and the lasers' ranges allow no more"
        raise InvalidInput("pull", parameters.pull, allowed)


def hand_forecast(configuration: BenchConfiguration, pull: float, duration: float) -> Forecast:
    """The storeys swing as far as storey 2 is pulled, to either side of their middle; nothing is driven."""
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    known = {"laser_1": 2.0 * pull / halves[0], "laser_2": 2.0 * pull / halves[1], "drift": 2.0 * pull}
    return Forecast(
        demands=tuple(
            Demand(quantity, known.get(quantity, 0.0), None, "storey 2 is released on a locked table")
            for quantity in bounds(configuration)
        ),
        duration=duration,
    )


def release_duration(parameters: FreeVibrationParameters, specimen: Specimen) -> float:
    """Expected length of the decays after releases by hand [s]."""
    return parameters.repeats * (RELEASE + decay_window(parameters, specimen) + WAITING)


def released_decays(
    parameters: FreeVibrationParameters, specimen: Specimen, setting: Setting, pace: Pace
) -> Generator[Step, Outcome, list[Decay]]:
    """The decays after releases by hand. Raises Unmeasurable when none can be used."""
    pull, window = parameters.pull, decay_window(parameters, specimen)
    silence = np.zeros(round((RELEASE + window) * setting.sample_rate))

    def once(activity: str) -> Generator[Step, Outcome, Decay]:
        request = (
            f"Hold storey 2 aside by {1e3 * pull:g} mm, without touching storey 1, and let it go without a push once"
            " the recording has begun."
        )
        yield Handle(Handwork.PULL_FRAME, specimen, request, pull)
        signals = yield from record(silence, setting.sample_rate, pace, activity)
        return released_decay(signals, setting)

    how = f"let go by hand, {window:.0f} s"
    planned = RELEASE + window + WAITING
    return (yield from repeat_decays(parameters, setting, pace, planned, once, "free vibration", how))
