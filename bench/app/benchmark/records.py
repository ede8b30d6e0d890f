"""Benchmarks of gain maps (from periodic orbits, and from runs of 120 s) and of motions under sampled records.

There are three cases of records: a block that stays at rest, one that rocks throughout, and an ensemble with scattered
parameters.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from bench.app.benchmark.section import Cell, Column, Section, Target, Timing, once, timed
from bench.comparators.catalogue import solve
from sim.ensemble import simulate_many
from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.linear import frame_matrices
from sim.maps import GainMap, gain_map
from sim.rocking import Motion, State, simulate
from sim.specimen import Block, Specimen

OMEGAS, BETAS = (12.0, 21.0), (0.1, 1.2)
"""Ranges of the map: Omega [rad/s] and beta [1]."""

AMPLITUDE = 1.01 * 9.81 / 8.0

FULL = 100
"""Points along each axis of the full map."""

MAP_COLUMNS = (
    Column("how", "how"),
    Column("points", "points", "d"),
    Column("found", "rocking branch", "d"),
    Column("error", "greatest error", ".1e"),
    Column("seconds", "time [s]", ".3g"),
    Column("per_point_ms", "per point [ms]", ".3g"),
)


RUNS_IN_LANES = (
    "The runs are advanced in lanes too, so that they have become faster like the orbits, and each orbit needs twelve "
    "more periods for its multipliers."
)
"""What limits the advantage of a map of periodic orbits."""


def gain_maps(n: int, runs: int, repetitions: int) -> Section:
    """Time the map of `n` x `n` points, and runs of 120 s at `runs` x `runs` of these points, and compare the times per
    point.
    """
    betas, omegas = np.linspace(*BETAS, n), np.linspace(*OMEGAS, n)
    specimen = Specimen()
    gain_map(specimen, betas[:2], omegas[:2], AMPLITUDE)
    found = [once(lambda: gain_map(specimen, betas, omegas, AMPLITUDE)) for _ in range(repetitions)]
    elapsed, chart = min(found, key=lambda pair: pair[0])
    chosen = np.unique(np.linspace(0, n - 1, runs).round().astype(np.int64))
    run_time, motions = once(lambda: _by_time(specimen, betas[chosen], omegas[chosen]))
    points, ran = n * n, len(motions)
    rows: list[dict[str, Cell]] = [
        {
            "how": "periodic orbits",
            "points": points,
            "found": int(chart.rocking.exists.sum()),
            "error": _map_error(chart),
            "seconds": elapsed,
            "per_point_ms": 1e3 * elapsed / points,
        },
        {
            "how": "120 s runs",
            "points": ran,
            "found": sum(_settled(chart, chosen, k, motion) for k, motion in enumerate(motions)),
            "error": None,
            "seconds": run_time,
            "per_point_ms": 1e3 * run_time / ran,
        },
    ]
    overturned = sum(motion.overturned is not None for motion in motions)
    notes = (
        "Orbits: both branches, peaks and Floquet multipliers. Runs: peaks of the last 20 periods; "
        f"the runs that overturn ({overturned} of {ran}) end early. A run reproduces the orbit if its alpha_2 "
        "differs from that of the orbit by less than 2 %.",
        "Error of the orbits: greatest relative difference from the peaks of one period integrated by dop853 at "
        "1e-13 from the start of the orbit, at nine points spread over the map.",
    )
    error = rows[0]["error"]
    # the cost per point of a coarser map differs, so its time cannot be scaled to the full map
    whole = n == FULL
    share = (elapsed / points) / (run_time / ran)
    targets = (
        Target("map of 100 x 100 points", 3.0, elapsed if whole else None, "s"),
        Target("time of the map relative to 120 s runs", 1 / 8, share if whole else None, "1", RUNS_IN_LANES),
        Target("greatest relative error of the map", 1e-9, error if isinstance(error, float) else None, "1"),
    )
    return Section("gain_map", "Gain map, Omega 12 to 21 rad/s, beta 0.1 to 1.2", MAP_COLUMNS, rows, notes, targets)


def _by_time(specimen: Specimen, betas: np.ndarray, omegas: np.ndarray) -> list[Motion]:
    places = [(float(beta), float(omega)) for beta in betas for omega in omegas]
    return simulate_many(
        [specimen.coupled(beta) for beta, _ in places],
        [SineProgram([Sweep.dwell(120.0, AMPLITUDE, omega)]) for _, omega in places],
        peaks_from=[120.0 - 20.0 * 2.0 * np.pi / omega for _, omega in places],
    )


def _settled(chart: GainMap, chosen: np.ndarray, k: int, motion: Motion) -> bool:
    """Whether run `k` reproduces the peak drift of the rocking orbit within 2 %."""
    i, j = divmod(k, chosen.size)
    exact = chart.rocking.peaks[chosen[i], chosen[j], 1]
    return motion.overturned is None and bool(abs(motion.peaks.drift / exact - 1.0) < 0.02)


def _map_error(chart: GainMap) -> float:
    """Greatest relative error of the peaks at nine points; the reference is another integrator over one period."""
    worst = 0.0
    rows, columns = chart.betas.size, chart.omegas.size
    for i in {0, rows // 2, rows - 1}:
        for j in {0, columns // 2, columns - 1}:
            phase, u1, u2, v1, v2, velocity = (float(value) for value in chart.sections[i, j])
            omega = float(chart.omegas[j])
            drive = SineProgram([Sweep.dwell(2.0 * np.pi / omega, chart.amplitude, omega)], phase=phase)
            start = State(u1, u2, v1, v2, 0.0, velocity)
            specimen = chart.specimen.coupled(float(chart.betas[i]))
            peaks = solve("dop853", specimen, drive, state=start, tolerance=1e-13).peaks
            exact = np.array([peaks.u1, peaks.drift, peaks.theta])
            worst = max(worst, float(np.abs(chart.rocking.peaks[i, j] / exact - 1.0).max()))
    return worst


DT, DURATION = 0.005, 40.0
"""Step and duration of the records [s]."""

ROCKING = Specimen(beta=0.4)
ROCKING_START = State(-0.0010828, 0.00037455, 0.049398, -0.11073, 0.0, 0.67994)
ROCKING_PHASE, ROCKING_OMEGA = 3.11068, 16.0
"""State on the steady orbit at beta 0.4, Omega 16 rad/s, to five digits. From this state, the block never comes to rest
under the sampled sine.
"""

SEED = 20

COLUMNS = (
    Column("case", "case"),
    Column("runs", "runs", "d"),
    Column("impacts", "impacts", "d"),
    Column("error", "error", ".1e"),
    Column("against", "against"),
    Column("min_ms", "min [ms]", ".3g"),
    Column("median_ms", "median [ms]", ".3g"),
)


def records(quick: bool, members: int) -> Section:
    """Run the three cases. With `quick`, they are repeated less often and the reference for the rocking case covers a
    shorter part of the record.
    """
    rest, at_rest = _resting(20 if quick else 60)
    rock, rocking = _rocking(20 if quick else 60, 2.0 if quick else 10.0)
    many, scattered, overturned = _scatter(members, 1 if quick else 3)
    notes = (
        f"Records of {DURATION:g} s at dt {DT:g} s, all computed with peaks. Errors of end states in SI units.",
        f"Members that overturn in the scatter case: {overturned} of {members}. The error is the greatest relative "
        "difference in peak drift among those of the first five members that do not overturn.",
    )
    targets = (
        Target("40 s record, block at rest", 0.3, 1e3 * rest.minimum, "ms"),
        Target("40 s record, rocking throughout", 12.0, 1e3 * rock.minimum, "ms"),
        Target(f"scatter of 1 000 members (scaled from {members})", 10.0, many.minimum * 1000 / members, "s"),
    )
    return Section("records", "Records", COLUMNS, [at_rest, rocking, scattered], notes, targets)


def noise(duration: float, peak: float) -> NDArray[np.float64]:
    """Band-limited noise, 1.5 to 8 Hz, with rise and decay, shape (n,), scaled to `peak` [m/s2]."""
    n = round(duration / DT) + 1
    spectrum = np.fft.rfft(np.random.default_rng(SEED).normal(size=n))
    frequency = np.fft.rfftfreq(n, DT)
    spectrum[(frequency < 1.5) | (frequency > 8.0)] = 0.0
    t = np.arange(n) * DT
    wave = np.fft.irfft(spectrum, n) * np.minimum(t / 3.0, 1.0) * np.exp(-np.maximum(t - 15.0, 0.0) / 8.0)
    return wave * (peak / np.abs(wave).max())


def _row(case: str, timing: Timing[Motion], error: float, against: str) -> dict[str, Cell]:
    return {
        "case": case,
        "runs": 1,
        "impacts": timing.result.impacts,
        "error": error,
        "against": against,
        "min_ms": 1e3 * timing.minimum,
        "median_ms": 1e3 * timing.median,
    }


def _resting(repetitions: int) -> tuple[Timing[Motion], dict[str, Cell]]:
    specimen = Specimen(beta=0.64)
    wave = noise(DURATION, 0.3 * specimen.uplift_acceleration)
    record = SampledRecord(wave, DT)
    timing = timed(lambda: simulate(specimen, record), repetitions)
    error = float(np.abs(timing.result.end.as_array()[:4] - _linear_end(specimen, wave)).max())
    return timing, _row("at rest throughout", timing, error, "scipy lsim")


def _linear_end(specimen: Specimen, wave: NDArray[np.float64]) -> NDArray[np.float64]:
    """[u1, u2, v1, v2] at the end of a record with the block at rest: exact for a piecewise linear record."""
    from scipy.signal import StateSpace, lsim

    mass, damping, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:, :2], a[2:, 2:] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    system = StateSpace(a, np.array([[0.0], [0.0], [-1.0], [-1.0]]), np.eye(4), np.zeros((4, 1)))
    states = lsim(system, wave, np.arange(wave.size) * DT)[1]
    return np.asarray(states, dtype=np.float64)[-1]


def _rocking(repetitions: int, checked: float) -> tuple[Timing[Motion], dict[str, Cell]]:
    t = np.arange(round(DURATION / DT) + 1) * DT
    amplitude = 1.01 * ROCKING.uplift_acceleration
    wave = amplitude * np.sin(ROCKING_OMEGA * t + ROCKING_PHASE)
    record = SampledRecord(wave, DT)
    timing = timed(lambda: simulate(ROCKING, record, state=ROCKING_START), repetitions)
    beginning = SampledRecord(wave[: round(checked / DT) + 1], DT)
    truth = solve("dop853", ROCKING, beginning, state=ROCKING_START, tolerance=1e-13).end.as_array()
    found = simulate(ROCKING, beginning, state=ROCKING_START).end.as_array()
    against = f"dop853, 1e-13, first {checked:g} s"
    return timing, _row("rocking throughout", timing, float(np.abs(found - truth).max()), against)


def _scatter(members: int, repetitions: int) -> tuple[Timing[list[Motion]], dict[str, Cell], int]:
    """The scatter case: timing, row and number of overturned members. Spring stiffness, spring length and restitution
    have standard deviations of 3 %, 5 % and 0.3 %; the record is strong noise.
    """
    rng = np.random.default_rng(SEED)
    record = SampledRecord(noise(DURATION, 1.2 * Specimen().uplift_acceleration), DT)
    specimens = [
        Specimen(
            beta=0.64 * (1.0 + 0.03 * float(a)),
            d=0.1 * (1.0 + 0.05 * float(b)),
            block=Block(restitution_factor=0.992 + 0.003 * float(c)),
        )
        for a, b, c in rng.normal(size=(members, 3))
    ]
    simulate_many(specimens[:2], record)
    times: list[float] = []
    motions: list[Motion] = []
    for _ in range(repetitions):
        elapsed, motions = once(lambda: simulate_many(specimens, record, overturning_angle=pi / 2))
        times.append(elapsed)
    error = 0.0
    for specimen, motion in list(zip(specimens, motions, strict=True))[:5]:
        other = solve("rk4-located", specimen, record, step=2e-4)
        if motion.overturned is None:
            error = max(error, abs(other.peaks.drift / motion.peaks.drift - 1.0))
    timing = Timing(min(times), float(np.median(times)), motions)
    row: dict[str, Cell] = {
        "case": "scatter of parameters",
        "runs": members,
        "impacts": sum(motion.impacts for motion in motions),
        "error": error,
        "against": "rk4-located, 0.2 ms",
        "min_ms": 1e3 * timing.minimum,
        "median_ms": 1e3 * timing.median,
    }
    return timing, row, sum(motion.overturned is not None for motion in motions)
