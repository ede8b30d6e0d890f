"""Settings, blocks and points of a small data file."""

from pathlib import Path
from typing import Any

import numpy as np

from bench.datafile.recorder import Recorder
from bench.datafile.tables import Column
from bench.events import Acquired, Event
from drivers.rig import Block, Channel
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from sim.parameters import Parameters, quantity

RATE = 2000.0
CHANNELS = (
    Channel("storey 1", "displacement", "m", 7.63e-6, -0.05, (-6553, 32767), "laser ILD1420-50 no. 1"),
    Channel("storey 2", "displacement", "m", 7.63e-6, -0.05, (-6553, 32767), "laser ILD1420-50 no. 2"),
    Channel("table", "acceleration", "m/s2", -3.0e-4, 0.0, (-32000, 32000), "accelerometer"),
)
PREDICTION = {
    "omega": Column(np.array([12.5, 15.0, 12.5]), "rad/s", "circular frequency"),
    "alpha_2": Column(np.array([0.1, 1.0 / 3.0, np.nan]), "1", "gain"),
    "stable": Column(np.array([True, False, True]), "", "whether the orbit is stable"),
    "layer": Column(np.array(["rocking", "rocking", "resting"]), "", "steady state"),
}
METADATA = {"configuration": "[limits]\ndrive_voltage = 8.0  # µ, Ω and ½\n", "operator": "", "seed": "7"}
FULL = HarmonicPoint(
    omega_rad_s=12.5,
    beta=0.25,
    status=PointStatus.STEADY,
    layer="rocking",
    alpha_2=0.1 + 0.2,
    alpha_2_uncertainty=1e-3,
    alpha_2_predicted=0.3,
    predicted_stable=True,
    agrees=False,
    drift_peak_m=1e-9,
    bare_drift_peak_m=2e-3,
    amplitude_m_s2=1.238512,
    bare_amplitude_m_s2=1.24,
    starts_tried=2,
    cycles_measured=24,
    settle_time_s=31.5,
    reason="größer als erwartet",
)


def begin(path: Path, **changes: Any) -> Recorder:
    """A recorder with the settings above, some of them changed."""
    settings: dict[str, Any] = {
        "channels": CHANNELS,
        "sample_rate": RATE,
        "point_type": HarmonicPoint,
        "metadata": METADATA,
        "tables": {"prediction": PREDICTION},
    }
    return Recorder(path, **(settings | changes))


def block(first: int, n: int, *, run: int = 1, time: float = 0.0, seed: int = 0) -> Acquired:
    """Random counts over the whole range of int16, which no rounding or scaling survives unnoticed."""
    rng = np.random.default_rng([seed, first])
    counts = rng.integers(-32768, 32768, (n, len(CHANNELS))).astype(np.int16)
    return Acquired(run, Block(first, counts), rng.uniform(-8.0, 8.0, n), time=time)


def record(recorder: Recorder, *events: Event) -> None:
    for event in events:
        recorder(event)
    recorder.close("completed", "all done")


class Small(Parameters):
    """A result of few fields."""

    number: int = quantity(0, "1", "number of the point")
    alpha_2: float = quantity(0.0, "1", "gain")
