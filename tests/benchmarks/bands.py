"""How long a band of predicted gains takes, and whether first order and Monte Carlo say the same.

    python -m tests.benchmarks.bands [--members 1000]

1. Points of the harmonic campaign: `members` specimens through the steady solver, all at once; the peer is a plain loop
   of `rocking_orbit` over a subset, each from the known orbit, as one would write it.
2. A record of 40 s: as many runs, coupled and bare.

Everything is compiled before. The standard deviation of the members is compared with the first order of the exact
sensitivities, for the specimen as assumed and for one that is known ten times better.
"""

import argparse
import os
import sys
from collections.abc import Callable
from time import perf_counter, process_time
from typing import TypeVar

import numpy as np

from bench.prediction.bands import expanded_uncertainty
from sim.ensemble import record_gains, steady_gains
from sim.excitation import SampledRecord
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.linear import steady_peaks
from sim.specimen import Specimen
from sim.steady import rocking_orbit

AMPLITUDE = 1.01 * 9.81 / 8.0
POINTS = ((0.25, 15.0), (0.64, 17.5), (0.64, 20.0), (0.97, 12.5))
SUBSET = 100
ALLOWED_POINT, ALLOWED_RECORD = 3.0, 10.0
"""Seconds on two cores."""

ASSUMED = SpecimenKnowledge()
TENTH = SpecimenKnowledge(stiffness=0.005, damping=0.03, restitution=0.001, spring=0.01)

Result = TypeVar("Result")


def timed(what: Callable[[], Result]) -> tuple[Result, float, float]:
    """What it returns, and the seconds that it took: by the clock, and of the processors."""
    clock, processors = perf_counter(), process_time()
    result = what()
    return result, perf_counter() - clock, process_time() - processors


def points(members: int) -> bool:
    """Print a line for each point; whether all were fast enough."""
    print(f"{members} members of a harmonic point, allowed {ALLOWED_POINT:g} s")
    print("beta  omega   clock [s]  CPU [s]  loop CPU  ratio  worst error  std assumed: MC / 1st order  a tenth")
    good = True
    for beta, omega in POINTS:
        specimen = Specimen().coupled(beta)
        branch = predict_gain(specimen, omega, AMPLITUDE).rocking
        assert branch is not None
        orbit = branch.orbit
        drawn = ASSUMED.draws(specimen, members, np.random.default_rng(1))
        steady_gains([orbit], [drawn[:2]])
        found, clock, processors = timed(lambda orbit=orbit, drawn=drawn: steady_gains([orbit], [drawn])[0, :, 1])

        def loop(orbit=orbit, drawn=drawn) -> list[float]:
            every = [rocking_orbit(each, orbit.omega, AMPLITUDE, orbit) for each in drawn[:SUBSET]]
            return [one.peaks.drift / steady_peaks(one.specimen, orbit.omega, AMPLITUDE).drift for one in every]

        alone, _, slow = timed(loop)
        slow *= members / SUBSET
        error = float(np.abs(found[:SUBSET] / alone - 1.0).max())
        ratios = []
        for known in (ASSUMED, TENTH):
            own = steady_gains([orbit], [known.draws(specimen, members, np.random.default_rng(1))])[0, :, 1]
            ratios.append(2.0 * float(np.nanstd(own)) / (expanded_uncertainty(branch, known) or np.nan))
        print(
            f"{beta:4g}  {omega:5g}  {clock:9.2f}  {processors:7.2f}  {slow:8.2f}  {slow / processors:5.1f}  "
            f"{error:11.1e}  {ratios[0]:27.3f}  {ratios[1]:7.3f}"
        )
        good &= clock <= ALLOWED_POINT
    return good


def record(members: int) -> bool:
    """Print the time of a record; whether it was fast enough."""
    random = np.random.default_rng(2)
    t = np.arange(0.0, 40.0, 0.01)
    noise = np.convolve(random.standard_normal(t.size), np.hanning(9), "same") * np.exp(-(((t - 12.0) / 9.0) ** 2))
    motion = SampledRecord(1.2 * Specimen().uplift_acceleration * noise / np.abs(noise).max(), 0.01)
    drawn = ASSUMED.draws(Specimen().coupled(0.64), members, np.random.default_rng(1))
    record_gains(drawn[:2], motion)
    gains, clock, processors = timed(lambda: record_gains(drawn, motion)[:, 1])
    stood = np.isfinite(gains)
    low, middle, high = np.nanquantile(gains, (0.025, 0.5, 0.975))
    print(f"{members} members of a record of 40 s, allowed {ALLOWED_RECORD:g} s: {clock:.2f} s, CPU {processors:.2f} s")
    print(f"  {stood.mean():.1%} stood; alpha_2 {middle:.3f}, 95 % from {low:.3f} to {high:.3f}")
    return bool(clock <= ALLOWED_RECORD)


def main() -> int:
    """0 when everything was fast enough."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--members", type=int, default=1000)
    members = parser.parse_args().members
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "")
    return 0 if all([points(members), record(members)]) else 1


if __name__ == "__main__":
    sys.exit(main())
