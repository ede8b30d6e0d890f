"""Whether the stated uncertainty of an identified frame is honest: many virtual benches, each with another truth.

    python -m tests.benchmarks.identify_frame [--trials 200] [--first 0] [--decays 1] [--excitation pulse|hand]

Each trial draws a frame (stiffness +-5 %, damping +-30 %), weighing errors of the masses (0.5 g), a spring (+-10 %),
the scale (+-0.2 %), clock and linearity of the lasers, and identifies the frame from decays recorded with
`sim.virtual_bench`, without engine. Printed for each quantity: the share of 95 % intervals (value +- 1.96 standard
uncertainties, the normal quantile) that hold the truth, the mean error over the stated uncertainty, the root mean
square of the error over it, and the mean stated uncertainty.
"""

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.covariance import CLOCKS, WAVES
from bench.analysis.free_decay.decay import Decay, pulsed_decay, released_decay
from bench.analysis.free_decay.response import NAMES, Constants, quantities
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from protocols.common.decays.frame import frame_result
from protocols.common.decays.pulse import QUIET, decay_pulse
from protocols.common.decays.recording import fit_setting
from protocols.coupling_stiffness.springs import measured_reference, spring_result
from protocols.free_vibration.experiment import RELEASE
from protocols.free_vibration.protocol import FreeVibrationParameters
from sim.arrangement import Arrangement
from sim.sensors import Laser
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters
from tests.benchmarks.estimates import Estimate

Array = NDArray[np.float64]

PARAMETERS = FreeVibrationParameters()
# the clock of a virtual bench is exact
CONFIGURATION = BenchConfiguration(analysis=SensorAccuracy(timebase=0.0))
ASSUMED = CONFIGURATION.specimen
VOLTS = 1.6
QUANTILE = 1.96


@dataclass(frozen=True, eq=False)
class Trial:
    """The quantities of `NAMES`, and k_C last if it was measured; slopes of the damping over their uncertainties."""

    estimates: list[Estimate]
    slopes: Array


def trial(seed: int, decays: int, excitation: str) -> Trial:
    """One bench, its frame, and what is found of it; `decays` of the bare frame and as many with the spring."""
    random = np.random.default_rng([20, seed])
    frame, k_c = _drawn(random)
    parameters = VirtualBenchParameters(laser_1=_laser(random), laser_2=_laser(random))
    setting = fit_setting(PARAMETERS, CONFIGURATION)
    truth = quantities(Constants(frame.m1, frame.m2, frame.k1, frame.k2, *frame.dashpots))
    specimen = Specimen(frame=frame)
    bench = VirtualBench(parameters, specimen, seed)
    recorded = partial(_released if excitation == "hand" else _pulsed, bench)
    bare = frame_result(
        [recorded(Arrangement(specimen)) for _ in range(decays)], setting.masses, setting.masses_covariance
    )
    estimates = [Estimate(*each) for each in zip(bare.frame.values, bare.uncertainty, truth, strict=True)]
    if excitation == "pulse":
        held = Arrangement(specimen.with_spring(k_c), block_clamped=True)
        spring = spring_result(
            0.25,
            frame_result([recorded(held) for _ in range(decays)], setting.masses, setting.masses_covariance),
            measured_reference(bare),
        )
        estimates.append(Estimate(spring.k_c, spring.uncertainty, k_c))
    return Trial(estimates, bare.slopes.values / bare.slope_uncertainty)


def _drawn(random: np.random.Generator) -> tuple[Frame, float]:
    frame, doubt = ASSUMED.frame, CONFIGURATION.uncertainty
    k1, k2 = 1.0 + doubt.stiffness * random.uniform(-1.0, 1.0, 2)
    xi1, xi2 = 1.0 + doubt.damping * random.uniform(-1.0, 1.0, 2)
    weighed = PARAMETERS.mass_uncertainty * random.standard_normal(2)
    values = {"m1": frame.m1 - weighed[0], "m2": frame.m2 - weighed[1], "k1": k1 * frame.k1, "k2": k2 * frame.k2}
    true = Frame(**(frame.model_dump() | values | {"xi1": xi1 * frame.xi1, "xi2": xi2 * frame.xi2}))
    label = random.choice([0.25, 0.64, 0.97])
    return true, float(label * frame.k1 * (1.0 + doubt.spring * random.uniform(-1.0, 1.0)))


def _laser(random: np.random.Generator) -> Laser:
    return Laser(
        scale_error=random.uniform(-0.002, 0.002),
        linearity_periods=random.choice(WAVES),
        clock_error=random.choice(CLOCKS) * random.choice([-1.0, 1.0]),
    )


def _signals(bench: VirtualBench, rest: float, volts: Array) -> Array:
    """What `bench.analysis.signals` makes of a drive played after a rest [s] over which the zero is taken."""
    channels = bench.channels
    signals = SignalMap(channels, "ground")
    values: list[Array] = []
    for drive in (np.zeros(round(rest * bench.parameters.sample_rate)), volts):
        counts = bench.run(drive)
        values.append(np.column_stack([channel.to_unit(counts[:, k]) for k, channel in enumerate(channels)]))
    signals.tare(values[0])
    return signals.of(values[1])


def _pulsed(bench: VirtualBench, arrangement: Arrangement) -> Decay:
    bench.mount(arrangement)
    assumed = ASSUMED.with_spring(arrangement.specimen.k_c) if arrangement.block_clamped else ASSUMED
    pulse = decay_pulse(PARAMETERS, CONFIGURATION, assumed)
    signals = _signals(bench, 2.0, pulse.record(VOLTS))
    return pulsed_decay(signals, fit_setting(PARAMETERS, CONFIGURATION), QUIET, pulse.begin)


def _released(bench: VirtualBench, arrangement: Arrangement) -> Decay:
    bench.mount(Arrangement(arrangement.specimen, table_locked=True, pull=PARAMETERS.pull))
    bench.arm()
    length = RELEASE + decay_pulse(PARAMETERS, CONFIGURATION, ASSUMED).window
    signals = _signals(bench, 2.0, np.zeros(round(length * bench.parameters.sample_rate)))
    return released_decay(signals, fit_setting(PARAMETERS, CONFIGURATION))


def main() -> None:
    """Run the trials and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--decays", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial: seeds follow it")
    parser.add_argument("--excitation", choices=("pulse", "hand"), default="pulse")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    asked = parser.parse_args()
    began = time.monotonic()
    with ProcessPoolExecutor(asked.processes) as pool:
        work = partial(trial, decays=asked.decays, excitation=asked.excitation)
        trials = list(pool.map(work, range(asked.first, asked.first + asked.trials)))
    values, u, truth = np.moveaxis(np.array([one.estimates for one in trials]), 2, 0)
    errors, stated = values / truth - 1.0, u / truth
    slopes = np.array([one.slopes for one in trials])
    print(f"{asked.trials} trials of {asked.decays} decays, {asked.excitation}, {time.monotonic() - began:.0f} s")
    print("quantity   in 95 %   bias/u   rms/u   mean u [%]")
    for place, name in enumerate((*NAMES, "k_c")[: errors.shape[1]]):
        share = errors[:, place] / stated[:, place]
        held = 100.0 * np.mean(np.abs(share) < QUANTILE)
        bias, size = float(np.mean(share)), float(np.sqrt(np.mean(share**2)))
        print(f"{name:8}   {held:5.1f} %   {bias:+6.2f}   {size:5.2f}   {100.0 * stated[:, place].mean():.4f}")
    alarms = 100.0 * np.mean(np.abs(slopes) > QUANTILE, axis=0)
    print(f"damping slopes beyond 1.96 u, though there is none: {alarms[0]:.1f} %, {alarms[1]:.1f} %")
    worst = int(np.abs(errors / stated).max(axis=1).argmax())
    print(f"largest: trial {asked.first + worst}, errors over u {np.round(errors[worst] / stated[worst], 2)}")


if __name__ == "__main__":
    main()
