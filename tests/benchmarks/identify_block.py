"""How well `rockbench run free-rocking` finds the restitution, against virtual benches whose restitution is known.

    python -m tests.benchmarks.identify_block [--repeats 200] [--workers 2] [--as-drawn]
    python -m tests.benchmarks.identify_block --scatter 0.003 --repeats 90

Each repeat is a bench of its own seed, a laser with a scale error within 0.2 % and a linearity error of the size that
the data sheet allows with any phase, and a block of the size that is stated whose r / r_th is drawn from 0.98 to 1. Its
tilts are recorded one after the other, without the engine, and analyse_tilt as a session does. With --as-drawn, waves
of the linearity error, the difference of the clocks and the height of the laser's beam are drawn as well, from the
distributions that the analysis assumes: that is what its intervals promise. Without, they are the default bench's,
which the analysis does not know.

With --scatter the restitution of each impact is drawn about its mean, relative, and the motion is that of the closed
form, as no virtual bench has such a block; the laser has noise of 10 um and no other error.
"""

import argparse
from collections.abc import Sequence
from functools import cached_property, partial
from math import sqrt
from multiprocessing import get_context
from typing import Any

import numpy as np

from bench.analysis.free_rocking.findings import CLOCK, WAVES, LaserErrors, Tilt, analyse_tilt, findings
from bench.analysis.free_rocking.swings import Recording
from bench.analysis.gain import SensorAccuracy
from protocols.free_rocking.plan import PlannedTilt, planned_tilts
from protocols.free_rocking.protocol import FreeRockingParameters
from sim import block_face
from sim.arrangement import Arrangement
from sim.free_rocking import FreeRocking, critical_angle, energy, frequency_parameter, theoretical_restitution
from sim.sensors import Laser
from sim.specimen import Block, Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters
from tests.benchmarks.estimates import Estimate

K = 1.959964
"""Coverage factor of 95 % for a normal distribution."""

WARM_UP = 0.1
"""Time before a recording in which filters and lasers settle on the new tilt [s], as in a rig."""

NAMES = ("ratio", "ratio by motion", "ratio by amplitudes", "trend", "alpha", "p")


def repeat(seed: int, *, as_drawn: bool) -> list[Estimate]:
    """What `NAMES` names, for one bench."""
    random = np.random.default_rng((2027, seed))
    factor = float(random.uniform(0.98, 1.0))
    drawn: dict[str, Any] = {
        "linearity_periods": random.uniform(*WAVES),
        "clock_error": random.uniform(-CLOCK, CLOCK),
    }
    laser = Laser(scale_error=float(random.uniform(-0.002, 0.002)), **(drawn if as_drawn else {}))
    asked, nominal = FreeRockingParameters(), Specimen()
    true = Specimen(block=Block(restitution_factor=factor)).coupled(0.0)
    bench = VirtualBench(VirtualBenchParameters(laser_2=laser), true, seed)
    height = asked.height + (float(random.normal(0.0, asked.height_uncertainty)) if as_drawn else 0.0)
    tilts = [_recorded(bench, true, nominal, asked, tilt, height) for tilt in planned_tilts(asked, nominal)]
    found = findings(
        tilts, LaserErrors(SensorAccuracy(), laser.measuring_range), asked.height, asked.height_uncertainty
    )
    theory = theoretical_restitution(nominal.block)
    ratios = (found.restitution, found.motion, found.relation)
    p = frequency_parameter(nominal.block, nominal.g)
    return [
        *(Estimate(each.value / theory, each.uncertainty / theory, factor) for each in ratios),
        Estimate(found.trend.value, found.trend.uncertainty, 0.0),
        Estimate(found.alpha.value, found.alpha.uncertainty, critical_angle(nominal.block)),
        Estimate(found.p.value, found.p.uncertainty, p),
    ]


class Scattered(FreeRocking):
    """Every impact has a restitution of its own: relative deviations `drawn`."""

    drawn: np.ndarray

    @cached_property
    def energies(self) -> np.ndarray:
        """As the impacts leave them, one after the other."""
        first = float(energy(np.array(self.tilt), self.alpha))
        return first * np.concatenate(([1.0], np.cumprod((self.restitution * (1.0 + self.drawn)) ** 2)))


def scattered(seed: int, *, scatter: float) -> list[Estimate]:
    """The same as `repeat` for impacts that differ by `scatter`; the mean is 0.97."""
    random, asked, nominal = np.random.default_rng((2028, seed)), FreeRockingParameters(), Specimen()
    alpha, p = critical_angle(nominal.block), frequency_parameter(nominal.block, nominal.g)
    theory, rate, r = theoretical_restitution(nominal.block), 2000.0, 0.97
    tilts: list[Tilt] = []
    for angle in (tilt.angle for tilt in planned_tilts(asked, nominal)):
        motion = Scattered(alpha, p, r, angle, start=3.0)
        object.__setattr__(motion, "drawn", scatter * random.standard_normal(400))
        times = np.arange(round((min(motion.rest_time, 40.0) + 1.25) * rate)) / rate
        seen = block_face.displacement(motion.angle(times), asked.height, nominal.block)
        seen += 1e-5 * random.standard_normal(times.size)
        taken = Recording(seen, rate, nominal.block, asked.height)
        tilts.append(analyse_tilt(taken, nominal, asked.least_swing * abs(angle)))
    found = findings(tilts, LaserErrors(SensorAccuracy(), 0.2), asked.height, asked.height_uncertainty)
    ratios = (found.restitution, found.motion, found.relation)
    shape = [(found.trend, 0.0), (found.alpha, alpha), (found.p, p)]
    return [
        *(Estimate(each.value / theory, each.uncertainty / theory, r / theory) for each in ratios),
        *(Estimate(each.value, each.uncertainty, truth) for each, truth in shape),
    ]


def _recorded(
    bench: VirtualBench,
    true: Specimen,
    nominal: Specimen,
    asked: FreeRockingParameters,
    tilt: PlannedTilt,
    height: float,
) -> Tilt:
    """A tilt that the laser watches at `height` [m]."""
    rate = bench.parameters.sample_rate
    bench.mount(Arrangement(true, table_locked=True, watched=height, tilt=tilt.angle))
    bench.run(np.zeros(round(WARM_UP * rate)))
    bench.arm()
    counts = bench.run(np.zeros(round(tilt.recording * rate)))
    values = bench.channels[3].to_unit(counts[:, 3])
    return analyse_tilt(
        Recording(values, rate, nominal.block, asked.height), nominal, asked.least_swing * abs(tilt.angle)
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--as-drawn", action="store_true")
    parser.add_argument("--scatter", type=float, default=0.0)
    given = parser.parse_args(arguments)
    one = partial(scattered, scatter=given.scatter) if given.scatter else partial(repeat, as_drawn=given.as_drawn)
    with get_context("spawn").Pool(given.workers) as pool:
        rows = np.array(pool.map(one, range(given.repeats), chunksize=5))
    error, stated = rows[:, :, 0] - rows[:, :, 2], rows[:, :, 1]
    inside = np.mean(np.abs(error) < K * stated, axis=0)
    kind = "waves and clocks drawn" if given.as_drawn else "the default laser"
    print(f"{given.repeats} benches, {f'impacts differ by {given.scatter:g}' if given.scatter else kind}")
    print(f"{'':20}{'95 % intervals hold':>20}{'bias / stated':>15}{'scatter / stated':>18}{'mean stated u':>15}")
    for column, name in enumerate(NAMES):
        u = sqrt(float(np.mean(stated[:, column] ** 2)))
        bias, scatter = error[:, column].mean() / u, error[:, column].std(ddof=1) / u
        print(f"{name:20}{100 * inside[column]:18.1f} %{bias:15.3f}{scatter:18.3f}{stated[:, column].mean():15.2e}")


if __name__ == "__main__":
    main()
