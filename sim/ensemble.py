"""Motions and gain coefficients of an ensemble of specimens, for Monte Carlo or first-order uncertainties.

The steady motions of the members are near a known one, so that Newton's method finds all of them together, starting at
the section of the known motion with its Jacobian. Members that are farther away are reached one by one, by
continuation. Under a record, each member is a separate run.
"""

from collections.abc import Sequence
from importlib import import_module
from itertools import chain, pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import Excitation, SampledRecord
from sim.linear import bare_peaks, steady_peaks
from sim.return_map import follow_each, jacobians, newton, parameters
from sim.rocking import (
    LARGEST_PART,
    MOST_IMPACTS,
    REST_ANGLE,
    SMALLEST_PART,
    TOLERANCE,
    Drive,
    Motion,
    RockingRun,
    State,
    Status,
    check_options,
    motion_of,
)
from sim.specimen import Specimen
from sim.steady import Orbit, resting_level
from sim.sweep import Done, processors, sweep


def simulate_many(
    specimens: Specimen | Sequence[Specimen],
    excitations: Excitation | Sequence[Excitation],
    *,
    states: State | Sequence[State] | None = None,
    peaks_from: float | Sequence[float] | None = 0.0,
    tolerance: float = TOLERANCE,
    overturning_angle: float = pi / 2,
    rest_angle: float = REST_ANGLE,
    scheduler: str | None = None,
) -> list[Motion]:
    """Results of `simulate` for many runs, in order, computed on all processors.

    A single specimen, excitation, state or `peaks_from` applies to all runs. Everything is checked before the first run
    starts. A block comes to rest when its next bounce stays below `rest_angle` [rad]; a larger one saves most of the
    hundreds of impacts of decaying bounces. `scheduler` is that of `sim.sweep.sweep`.

    Raises InvalidInput if the sequences differ in length or a run is refused.
    """
    import_module("sim.kernel.members")  # compile it once, before the threads start

    several = [len(item) for item in (specimens, excitations, states, peaks_from) if isinstance(item, Sequence)]
    runs = several[0] if several else 1
    if any(length != runs for length in several):
        raise InvalidInput("simulate_many", several, "the sequences must have the same length")

    models = list(specimens) if isinstance(specimens, Sequence) else [specimens]
    drives = [Drive(item) for item in (excitations if isinstance(excitations, Sequence) else [excitations])]
    check_options(tolerance, overturning_angle)

    prepared = [
        RockingRun(
            models[i % len(models)],
            drives[i % len(drives)],
            (states[i] if isinstance(states, Sequence) else states) or State(),
            None,
            peaks_from[i] if isinstance(peaks_from, Sequence) else peaks_from,
            tolerance,
            overturning_angle,
            rest_angle,
        )
        for i in range(runs)
    ]
    # group runs of equal order in batches that occupy every processor and take about a second at most
    alike: dict[int, list[int]] = {}
    for i, run in enumerate(prepared):
        alike.setdefault(run.order, []).append(i)
    share = -(-runs // processors(scheduler))
    size = min(share, max(SMALLEST_PART, min(-(-share // 4), LARGEST_PART)))
    parts = [places[i : i + size] for places in alike.values() for i in range(0, len(places), size)]
    motions = sweep(side_by_side, [[prepared[i] for i in part] for part in parts], scheduler)
    ordered = dict(zip(chain(*parts), chain(*motions), strict=True))
    return [ordered[i] for i in range(runs)]


def side_by_side(runs: list[RockingRun]) -> list[Motion]:
    """Results of several runs, computed together and bit-identical to those of `RockingRun.motion`. The runs must have
    no sample times, and must agree in order, tolerance, overturning angle and angle of rest.
    """
    from sim.kernel import members as kernel

    drives = list({id(run.drive): run.drive for run in runs}.values())
    ends = np.cumsum([len(drive.segments) for drive in drives])
    span = {id(drive): (end - len(drive.segments), end) for drive, end in zip(drives, ends, strict=True)}
    models = list({id(run.specimen): run.specimen for run in runs}.values())
    place = {id(specimen): i for i, specimen in enumerate(models)}
    states = np.array([run.state.as_array() for run in runs])
    reports = np.zeros((len(runs), kernel.REPORT))
    kernel.advance_members(
        np.array([specimen.packed() for specimen in models]),
        np.array([place[id(run.specimen)] for run in runs]),
        np.concatenate([drive.segments for drive in drives]),
        np.array([span[id(run.drive)] for run in runs]),
        states,
        runs[0].order,
        runs[0].tolerance,
        runs[0].overturning_angle,
        runs[0].rest_angle,
        np.array([np.inf if run.peaks_from is None else run.peaks_from for run in runs]),
        MOST_IMPACTS,
        reports,
    )
    return [
        motion_of(report, x, None, watched=run.peaks_from is not None)
        for run, x, report in zip(runs, states, reports, strict=True)
    ]


Floats = NDArray[np.float64]

RUN_TOLERANCE = 1e-8
"""Integration tolerance of the runs under a record, far below the statistical error of an ensemble."""

RUN_REST_ANGLE = 1e-8
"""Angle of a bounce [rad] below which the block comes to rest in these runs, for the same reason."""

_Member = tuple[Orbit, Specimen]
"""A known orbit, and the specimen whose orbit is searched for from there."""

CHUNK = 500
"""Approximate number of members integrated together: large enough to share the overhead of a step, small enough for
regular reports of the progress.
"""


def steady_gains(
    orbits: Sequence[Orbit],
    members: Sequence[Sequence[Specimen]],
    bare_amplitude: float | None = None,
    done: Done | None = None,
    scheduler: str | None = None,
) -> Floats:
    """alpha_1 and alpha_2 of m specimens on the branches of n orbits, shape (n, m, 2), computed in parallel.

    `members[i]` are the specimens near `orbits[i]`, at the frequency and amplitude of that orbit. `bare_amplitude`
    [m/s2] is the amplitude of the test without the block, if different. The gains are NaN where a member does not have
    the motion of the branch: its block does not rest, or continuation does not reach its orbit. `done` is called as
    parts of the work are completed.
    """
    every = [(orbit, specimen) for orbit, own in zip(orbits, members, strict=True) for specimen in own]
    parts = max(processors(scheduler), len(every) // CHUNK)
    bounds = np.linspace(0, len(every), parts + 1).astype(int).tolist()
    chunks = [every[first:last] for first, last in pairwise(bounds) if last > first]
    if not chunks:
        return np.empty((len(orbits), 0, 2))
    peaks = np.concatenate(sweep(_peaks, chunks, scheduler, done=done))
    omega = np.array([orbit.omega for orbit, _ in every])
    amplitude = np.array([orbit.amplitude if bare_amplitude is None else bare_amplitude for orbit, _ in every])
    bare = bare_peaks([specimen.frame for _, specimen in every], omega, amplitude)
    return (peaks / bare).reshape(len(orbits), -1, 2)


def record_gains(members: Sequence[Specimen], record: SampledRecord, scheduler: str | None = None) -> Floats:
    """alpha_1 and alpha_2 of n specimens under `record`, started from rest, shape (n, 2), computed on all processors.

    NaN where the block overturns or the run fails.
    """
    every = [*members, *(specimen.bare() for specimen in members)]
    runs = simulate_many(every, record, tolerance=RUN_TOLERANCE, rest_angle=RUN_REST_ANGLE, scheduler=scheduler)
    peaks = np.array([(run.peaks.u1, run.peaks.drift) for run in runs]).reshape(2, -1, 2)
    stood = np.array([run.status is Status.COMPLETED for run in runs[: len(members)]], dtype=np.bool_)
    return np.where(stood[:, None], peaks[0] / peaks[1], np.nan)


def _peaks(chunk: Sequence[_Member]) -> Floats:
    """Peaks of u1 and drift [m], shape (n, 2)."""
    peaks = np.full((len(chunk), 2), np.nan)
    rocking = [i for i, (orbit, _) in enumerate(chunk) if orbit.branch == "rocking"]
    if rocking:
        peaks[rocking] = _rocking([chunk[i] for i in rocking])
    for i, (orbit, specimen) in enumerate(chunk):
        if orbit.branch == "resting" and orbit.amplitude < resting_level(specimen, orbit.omega):
            found = steady_peaks(specimen, orbit.omega, orbit.amplitude, resting=True)
            if not specimen.beta or found.u1 < specimen.d:
                peaks[i] = found.u1, found.drift
    return peaks


def _rocking(chunk: Sequence[_Member]) -> Floats:
    orbits = list({id(orbit): orbit for orbit, _ in chunk}.values())
    place = {id(orbit): k for k, orbit in enumerate(orbits)}
    origin = np.concatenate([parameters(orbit.specimen, orbit.omega, orbit.amplitude) for orbit in orbits])
    sections = np.array([orbit.section for orbit in orbits])
    slopes = jacobians(origin, sections, 2)
    of = np.array([place[id(orbit)] for orbit, _ in chunk])
    q = np.concatenate([parameters(specimen, orbit.omega, orbit.amplitude) for orbit, specimen in chunk])
    found = newton(q, sections[of], slopes[of], accuracy=None)
    for k in range(len(orbits)):
        missing = np.flatnonzero(~found.found & (of == k))
        solutions = follow_each(origin[k], sections[k], q[missing]) if missing.size else []
        for i, solution in zip(missing.tolist(), solutions, strict=True):
            if solution is not None:
                found.put(i, solution)
    return found.peaks[:, :2]
