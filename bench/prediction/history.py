"""Time histories under a sine, from rest or in the steady state, as in Fig. 5 of the paper."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.comparators.catalogue import solve
from bench.datafile.tables import Column, Table
from bench.prediction.conditioning import PERIODIC, Condition, condition, rounded_time
from bench.prediction.requests import HistoryRequest
from bench.prediction.steady import amplitude_of
from bench.progress import Progress, silent
from sim.errors import InvalidInput
from sim.excitation import SineProgram, Sweep
from sim.gain import predict_gain
from sim.linear import steady_response
from sim.specimen import Specimen
from sim.steady import Orbit

FROM_REST = "from rest"
"""Name of the motion from rest; a steady motion is named after its branch."""

TIME = "time_s"

QUANTITIES: dict[str, tuple[str, str]] = {
    TIME: ("s", "time since the start of the sine, or of one of its periods"),
    "base_acceleration_m_s2": ("m/s2", "acceleration of the base"),
    "u1_m": ("m", "displacement of the first storey relative to the base"),
    "drift_m": ("m", "drift u2 - u1"),
    "theta_rad": ("rad", "rotation of the block, positive when its top moves towards the frame"),
    "bare_u1_m": ("m", "displacement of the first storey of the bare frame"),
    "bare_drift_m": ("m", "drift of the bare frame"),
}
"""Columns of a history: unit and description. The coupled quantities are NaN after an early end of the motion."""


@dataclass(frozen=True, eq=False)
class History:
    """Motion over time: `values` contains an array of shape (n,) for each of `QUANTITIES`.

    `status` states how the motion ended at `end_time` [s]; `impacts` is the number of impacts until then.
    """

    omega: float
    beta: float
    motion: str
    status: str
    end_time: float
    impacts: int
    values: Mapping[str, NDArray[np.float64]]
    condition: Condition = PERIODIC

    def peak(self, name: str) -> float:
        """Largest absolute value of a sampled quantity; NaN if there are no samples."""
        values = np.abs(self.values[name])
        return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def histories(specimen: Specimen, request: HistoryRequest, progress: Progress = silent) -> list[History]:
    """One history for each frequency at each stiffness, or one for each steady motion that exists there.

    Raises InvalidInput for steady motions by a solver other than taylor, or a tolerance outside the solver's range.
    """
    if request.steady and request.solver != "taylor":
        raise InvalidInput(
            "--solver", request.solver, "only taylor computes steady histories: choose it, or omit --steady"
        )
    amplitude = amplitude_of(specimen, request)
    made: list[History] = []
    points, begun = len(request.beta) * len(request.omega), 0
    for beta in request.beta:
        coupled = specimen.coupled(beta)
        for omega in request.omega:
            progress("computing the histories", begun, points)
            begun += 1
            if request.steady:
                prediction = predict_gain(coupled, omega, amplitude)
                made += [_steady(branch.orbit, request) for branch in prediction.branches.values()]
            else:
                made.append(_from_rest(coupled, omega, amplitude, request))
    return made


def history_table(made: Sequence[History]) -> Table:
    """Table of all histories, concatenated, with one row per sample."""
    columns = _points([history for history in made for _ in history.values[TIME]])
    for name, (unit, description) in QUANTITIES.items():
        joined = np.concatenate([history.values[name] for history in made]) if made else np.empty(0)
        columns[name] = Column(joined, unit, description)
    return columns


def runs_table(made: Sequence[History]) -> Table:
    """Table with one row per history: how it ended, and the largest magnitudes of its samples."""
    columns = _points(made)
    columns["status"] = Column(
        np.array([history.status for history in made], np.str_), "", "final status of the motion"
    )
    columns["end_time_s"] = Column(
        np.array([rounded_time(history.end_time, history.condition.end_time_error) for history in made], np.float64),
        "s",
        "time at which the motion ended, rounded to the digits that its error leaves valid; absent if none is valid",
    )
    columns["end_time_error_s"] = Column(
        np.array([history.condition.end_time_error for history in made], np.float64),
        "s",
        "error of the end time, from a run at the finest tolerance; absent if that run ends differently",
    )
    columns["impacts"] = Column(
        np.array([history.impacts for history in made], np.int64), "1", "number of impacts until the end"
    )
    columns["condition_number"] = Column(
        np.array([history.condition.number for history in made], np.float64),
        "1",
        "greatest relative change of the motion per relative change of amplitude, k1, k_C or restitution factor",
    )
    columns["relative_error"] = Column(
        np.array([history.condition.error for history in made], np.float64),
        "1",
        "greatest error of the samples, relative to the greatest magnitude of each state",
    )
    for name in ("u1_m", "drift_m", "theta_rad", "bare_u1_m", "bare_drift_m"):
        unit, description = QUANTITIES[name]
        peaks = np.array([history.peak(name) for history in made], np.float64)
        columns[f"sampled_max_{name}"] = Column(peaks, unit, f"largest absolute value of the samples: {description}")
    return columns


def _points(made: Sequence[History]) -> dict[str, Column]:
    return {
        "omega_rad_s": Column(
            np.array([history.omega for history in made], np.float64), "rad/s", "circular frequency of the base motion"
        ),
        "beta": Column(np.array([history.beta for history in made], np.float64), "1", "stiffness ratio of the spring"),
        "motion": Column(
            np.array([history.motion for history in made], np.str_), "", "from rest, or the branch of the steady motion"
        ),
    }


def _from_rest(coupled: Specimen, omega: float, amplitude: float, request: HistoryRequest) -> History:
    dwell = Sweep.dwell(request.duration, amplitude, omega)
    drive = SineProgram([dwell])
    step = tau / omega / request.samples_per_period
    times = np.arange(int(request.duration / step) + 1, dtype=np.float64) * step
    motion, bare = (
        solve(request.solver, specimen, drive, sample_times=times, tolerance=request.tolerance)
        for specimen in (coupled, coupled.bare())
    )
    return History(
        omega=omega,
        beta=coupled.label or 0.0,
        motion=FROM_REST,
        status=str(motion.status),
        end_time=motion.end_time,
        impacts=motion.impacts,
        values=_values(
            times,
            amplitude * np.sin(omega * times),
            _filled(motion.samples, times.size)[:, [0, 1, 4]],
            _filled(bare.samples, times.size)[:, :2],
        ),
        condition=condition(coupled, dwell, times, motion),
    )


def _steady(orbit: Orbit, request: HistoryRequest) -> History:
    """History over full periods, from an upward zero crossing of the base's acceleration."""
    n, periods = request.samples_per_period, request.periods
    one = orbit.samples(n)[:, 1:]
    count = n * periods + 1
    phases = np.arange(count, dtype=np.float64) * (tau / n)
    coupled = np.resize(one, (count, 3))
    rotation = np.exp(1j * phases)
    u1, u2 = steady_response(orbit.specimen, orbit.omega, orbit.amplitude)
    bare = np.column_stack([(u1 * rotation).imag, (u2 * rotation).imag])
    return History(
        omega=orbit.omega,
        beta=orbit.specimen.label or 0.0,
        motion=orbit.branch,
        status="steady" if orbit.stable else "steady, unstable",
        end_time=periods * orbit.period,
        impacts=periods * orbit.impacts,
        values=_values(phases / orbit.omega, orbit.amplitude * np.sin(phases), coupled, bare),
    )


def _values(
    times: NDArray[np.float64], base: NDArray[np.float64], coupled: NDArray[np.float64], bare: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Arrays for `QUANTITIES` from coupled (u1, u2, theta), shape (n, 3), and bare (u1, u2), shape (n, 2)."""
    return dict(zip(QUANTITIES, _in_order(times, base, coupled, bare), strict=True))


def _in_order(
    times: NDArray[np.float64], base: NDArray[np.float64], coupled: NDArray[np.float64], bare: NDArray[np.float64]
) -> Iterator[NDArray[np.float64]]:
    yield from (times, base, coupled[:, 0], coupled[:, 1] - coupled[:, 0], coupled[:, 2])
    yield from (bare[:, 0], bare[:, 1] - bare[:, 0])


def _filled(samples: NDArray[np.float64] | None, n: int) -> NDArray[np.float64]:
    """Pad the samples with NaN to `n` rows."""
    filled = np.full((n, 6), np.nan)
    if samples is not None:
        filled[: len(samples)] = samples
    return filled
