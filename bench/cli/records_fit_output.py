"""A fitted record on the way out of `rockbench records fit`: as JSON, as text, as a figure, as a file of columns."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.cli.words import number, one_line
from bench.control.preparation import PreparedMotion
from bench.prediction.stroke_fits import StrokeFits, change_at, change_over
from bench.report.files import write_new
from bench.report.text_table import TextColumn, text_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.report.stroke_figure import History


def content_of(fits: StrokeFits) -> dict[str, Any]:
    """The fits as JSON says them: SI units, named at the end of each key."""
    record = fits.record
    first = fits.chosen.fit
    return {
        "record": {
            "name": record.name,
            "source": record.source,
            "sha256": record.sha256,
            "synthetic": record.synthetic,
        },
        "reach": {"displacement_m": fits.reach.displacement, "velocity_m_s": fits.reach.velocity},
        "before": _motion(fits.unfitted),
        "fits": {str(method): {**_motion(motion), **_change(fits, motion)} for method, motion in fits.fitted.items()},
        "refused": {str(method): str(reason) for method, reason in fits.refused.items()},
        "response_spectrum": None
        if first is None
        else {
            "period_s": first.periods.tolist(),
            "before_m_s2": first.spectrum_before.tolist(),
            **{
                f"{method}_m_s2": motion.fit.spectrum.tolist()
                for method, motion in fits.fitted.items()
                if motion.fit is not None
            },
        },
    }


def text_of(fits: StrokeFits) -> str:
    """The fits as a person reads them."""
    motion_columns = (("peak", "m/s2"), ("velocity", "m/s"), ("stroke", "mm"), ("end", "mm"))
    changes = [*(f"at {period:.3g} s" for period in fits.own), "rms", "most"]
    columns = [
        TextColumn("", words=True),
        *(TextColumn(title, unit) for title, unit in motion_columns),
        *(TextColumn(title, "%") for title in changes),
    ]
    rows = [["before", *_numbers(fits.unfitted), *["-"] * len(changes)]]
    for method, motion in fits.fitted.items():
        change = _change(fits, motion)
        shares = [*change["change_at_own_periods"], change["change_rms"], change["change_most"]]
        rows.append([str(method), *_numbers(motion), *(f"{100.0 * share:+.2f}" for share in shares)])
    rows += [[str(method), *["refused"] * (len(columns) - 1)] for method in fits.refused]
    record, reach = fits.record, fits.reach
    return "\n".join(
        [
            f"{record.name}: {record.source}, sha256 {record.sha256}",
            *fits.unfitted.steps,
            f"the table may move {1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s",
            "",
            text_table(columns, rows),
            "",
            "changes of the response spectrum: at the frame's periods, and over 0.1 to 2 s",
            *(f"{method}: {motion.fit.done}" for method, motion in fits.fitted.items() if motion.fit is not None),
            *(f"{method}: {reason}" for method, reason in fits.refused.items()),
        ]
    )


def figure_of(fits: StrokeFits) -> "Figure":
    """Histories and spectra, before and after."""
    from bench.report.stroke_figure import Spectra, stroke_figure

    motions = {"before": fits.unfitted, **{str(method): motion for method, motion in fits.fitted.items()}}
    done = [motion.fit for motion in fits.fitted.values() if motion.fit is not None]
    spectra = Spectra(done[0].periods, [done[0].spectrum_before, *(fit.spectrum for fit in done)], fits.own)
    histories = [_history(name, motion) for name, motion in motions.items()]
    return stroke_figure(fits.record.name, histories, spectra, (fits.reach.displacement, fits.reach.velocity))


def write_record(path: Path, fits: StrokeFits) -> None:
    """Write the chosen fit as columns that `bench.accelerograms.columns` reads, every digit of it.

    Raises InvalidInput when `path` exists, RockbenchError when the disk fails.
    """
    motion, record = fits.chosen, fits.record
    time = np.arange(motion.record.acceleration.size) * motion.record.dt
    comments = [
        "earthquake record made to fit a shake table",
        f"from: {record.name}, {record.source}, {record.format}",
        f"sha256 of that: {record.sha256}",
        *motion.steps,
        f"begins at {motion.begin:.9g} s on the clock of that record; at rest at both ends",
        f"acceleration in m/s2, dt = {motion.record.dt:.12g} s",
    ]
    rows = (f"{t:.12g},{a!r}\n" for t, a in zip(time.tolist(), motion.record.acceleration.tolist(), strict=True))

    def write(unfinished: Path) -> None:
        with unfinished.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(f"# {one_line(comment)}\n" for comment in comments)
            file.write("t [s],a [m/s2]\n")
            file.writelines(rows)

    write_new(path, write)


def _motion(motion: PreparedMotion) -> dict[str, Any]:
    return {
        "peak_m_s2": motion.peak,
        "peak_velocity_m_s": motion.motion.peak_velocity,
        "peak_displacement_m": motion.motion.peak_displacement,
        "final_velocity_m_s": float(motion.motion.velocity[-1]),
        "final_displacement_m": float(motion.motion.displacement[-1]),
        "factor": motion.factor,
        "begin_s": motion.begin,
        "dt_s": motion.record.dt,
        "duration_s": motion.record.duration,
        "steps": list(motion.steps),
    }


def _change(fits: StrokeFits, motion: PreparedMotion) -> dict[str, Any]:
    if motion.fit is None:
        return {}
    rms, most = change_over(motion.fit)
    return {
        "own_periods_s": fits.own.tolist(),
        "change_at_own_periods": change_at(motion.fit, fits.own).tolist(),
        "change_rms": rms,
        "change_most": most,
    }


def _numbers(motion: PreparedMotion) -> list[str]:
    table = motion.motion
    end = f"{1e3 * float(table.displacement[-1]):.2g}"
    return [number(motion.peak), number(table.peak_velocity), number(1e3 * table.peak_displacement), end]


def _history(name: str, motion: PreparedMotion) -> "History":
    from bench.report.stroke_figure import History

    size, dt = motion.record.acceleration.size, motion.record.dt
    time = np.asarray(motion.begin + np.arange(size) * dt, dtype=np.float64)
    return History(name, time, motion.record.acceleration, motion.motion.velocity, motion.motion.displacement)
