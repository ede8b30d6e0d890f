"""The bench at rest: valid samples and noise of each channel with the output at zero, and the safety inputs."""

from collections.abc import Iterator

import numpy as np

from bench.analysis.check_line import CheckLine, judged, passed, stated, untested
from bench.analysis.cycles import COMPLETE
from bench.analysis.gain import SensorAccuracy
from bench.config.model import BenchConfiguration
from bench.engine.steps import Heard
from drivers.rig import Channel, Counts
from protocols.check.protocol import CheckParameters

_STUCK = 0.01
"""Scatter [counts] below which a channel is stuck: one sample in ten thousand that differs gives as much."""

_LASERS = ("laser_1", "laser_2")

_MISSING = "the program does not read it: see that it opens the enable chain by itself"
_ALONE = "nothing opens the enable relay when the program dies: wire a heartbeat relay, or set a watchdog"


def resting_lines(heard: Heard, parameters: CheckParameters, accuracy: SensorAccuracy) -> Iterator[CheckLine]:
    """Two lines for each channel: share of valid samples, and noise where there are enough of them.

    A laser may be as noisy as its output is coarse: more would be the target or the bench.
    """
    limits = {
        "table_displacement": parameters.displacement_noise,
        "table_acceleration": parameters.acceleration_noise,
        **dict.fromkeys(_LASERS, accuracy.laser_resolution),
    }
    for column, channel in enumerate(heard.channels):
        counts = heard.counts[:, column]
        valid = (counts >= channel.valid[0]) & (counts <= channel.valid[1])
        share = float(valid.mean())
        what = "valid samples at rest"
        yield judged(channel.name, what, share, (COMPLETE, 1.0), "1", _reason(channel, counts[~valid]), expected=1.0)
        if share >= COMPLETE:
            yield _noise(channel, counts[valid], limits.get(channel.name))


def safety_lines(configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """A line for each safety input, once the bench has been acquired at rest; none for a simulated bench.

    An input that is open refuses the arming, and one that opens ends the check: those that are read were good.
    """
    if configuration.backend != "hardware":
        return
    daq = configuration.hardware.daq
    for name, given in daq.safety_inputs.items():
        yield passed(name, f"{given.line} was {given.good}: good")
    for name in daq.missing_inputs:
        yield untested(name, "safety input", _MISSING)
    if daq.watchdog is None and daq.heartbeat is None:
        yield untested("enable line", "heartbeat or watchdog", _ALONE)


def _noise(channel: Channel, counts: Counts, limit: float | None) -> CheckLine:
    noise, least = float(np.std(channel.to_unit(counts))), _STUCK * abs(channel.scale)
    if limit is None and noise >= least:
        return stated(channel.name, "noise at rest", noise, channel.unit)
    if noise < least:
        remedy = "it always says the same: see whether the sensor is connected and supplied, and the terminal is right"
    else:
        remedy = "let the bench come to rest, then see to cable, shield and ground, and to the sensor's target"
    allowed = least, np.inf if limit is None else limit
    return judged(channel.name, "noise at rest", noise, allowed, channel.unit, remedy)


def _reason(channel: Channel, invalid: Counts) -> str:
    """Why samples are no measurements, by what most of them say."""
    if invalid.size == 0:
        return ""
    values, numbers = np.unique(invalid, return_counts=True)
    most = int(values[numbers.argmax()])
    why = channel.faults.get(most)
    if why is None:
        end = "lower" if most < channel.valid[0] else "upper"
        why = f"beyond its {end} end"
    if channel.name in _LASERS:
        return f"{why}: see whether the laser is on and the storey rests in the middle of its range"
    return f"{why}: see to the sensor's supply, its cable, and the terminal and range of the input"
