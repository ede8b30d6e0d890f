"""What is refused before anything moves."""

from bench.config.model import BenchConfiguration
from protocols.common.decays.masses import check_masses
from protocols.common.decays.parameters import DecayParameters
from protocols.common.decays.playing import LEAST
from protocols.common.decays.pulse import SHARE, planned, pulse_of
from sim.errors import InvalidInput
from sim.specimen import Specimen

_FEWEST = 20
"""Samples of a pulse below which it has no shape."""


def check_pulse(parameters: DecayParameters, configuration: BenchConfiguration, specimen: Specimen) -> None:
    """Raise InvalidInput for a pulse that has no shape, or that the limits leave too little of."""
    check_masses(parameters, configuration)
    pulse = pulse_of(parameters, configuration, specimen)
    if pulse.shape.size < _FEWEST:
        least = _FEWEST / configuration.sample_rate
        raise InvalidInput("pulse", pulse.duration, f"at this sample rate it needs {least:g} s at least")
    if parameters.drift < LEAST:
        raise InvalidInput("drift", parameters.drift, f"the steps of the lasers drown a decay below {LEAST:g} m")
    found = planned(parameters, configuration, specimen)
    if found.drift < LEAST:
        allowed = f"limits of {found.binds} leave {found.drift:.2g} m of drift, a decay needs {LEAST:g} m"
        raise InvalidInput("pulse", pulse.duration, f"{allowed}: raise that limit, or give another length")


def check_pull(parameters: DecayParameters, pull: float, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput for a pull that leaves the lasers' range or the drift's limit, or that they hardly see."""
    check_masses(parameters, configuration)
    # the storeys swing to the other side of where they are held
    room = min(
        SHARE * 0.5 * configuration.limits.drift,
        *(SHARE * 0.5 * min(configuration.limits.laser_range, 1.0) * 0.5 * each for each in configuration.laser_ranges),
    )
    if not LEAST <= pull <= room:
        allowed = f"{LEAST:g} to {room:.3g} m: limits.drift and the lasers' ranges allow no more"
        raise InvalidInput("pull", pull, allowed)
