"""`rockbench records fit`: fits a record to the stroke of the bench, and prints the change of its spectrum."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.cli.inputs import configuration_from, request_from, warn_of_unusual
from bench.app.cli.options import BenchFile, Handed, Json, RecordText, ResultOptions, with_flags
from bench.app.cli.output import Result, check_files, deliver
from bench.app.formatting import number, one_line
from bench.figures.text_table import TextColumn, text_table
from bench.prediction.requests import StrokeFitRequest
from bench.progress import silent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bench.control.preparation import PreparedMotion
    from bench.figures.record_figure import History
    from bench.prediction.stroke_fits import StrokeFits


def _fit(
    typed: Mapping[str, Any],
    file: RecordText,
    /,
    *,
    config: BenchFile = None,
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="FILE",
            help="Write the fitted record as columns t,a: the record of least change unless --method selects another.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        Parameter(
            name="--plot",
            metavar="FILE",
            help="Plot histories and spectra before and after the fit to FILE (.png, .pdf or .svg).",
        ),
    ] = None,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Fit a record to the stroke and the velocity of the configured bench, with rest at its beginning and end.

    The record is scaled in time (--length-ratio), trimmed, limited to a band, scaled to a peak, then fitted: by the
    least change below 2 Hz, by a high-pass filter, or by both for comparison. Stroke, velocity and the change of the
    response spectrum are printed. Nothing is written unless requested. The exit code is 0 if the fit succeeded, 1 if
    writing failed, 2 if an input was refused. Existing files are never overwritten.
    """
    progress("loading the program")
    from bench.accelerograms.reference import RecordReference
    from bench.prediction.files import provenance
    from bench.prediction.stroke_fits import stroke_fits

    configuration = configuration_from(config, None)
    request = request_from(StrokeFitRequest, typed)
    options = ResultOptions(json=as_json, out=out, plot=plot)
    check_files(options)
    warn_of_unusual(request, configuration.known_specimen)
    progress("fitting the record to the stroke")
    fits = stroke_fits(RecordReference.parse(file).read(), request, configuration)
    result = Result(
        title="record fitted to the stroke",
        content=lambda: _content(fits),
        text=lambda: _text(fits),
        figure=lambda: _figure(fits),
        metadata=provenance(request, configuration.known_specimen) if as_json else {},
        tables={},
        write=lambda path: _write_record(path, fits),
    )
    return deliver(lambda: result, options, progress)


fit = with_flags(StrokeFitRequest, "Parameters of fit", _fit)


def _content(fits: "StrokeFits") -> dict[str, Any]:
    """Content of the fits for JSON, in the SI units stated at the end of the keys."""
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


def _text(fits: "StrokeFits") -> str:
    """The fits as text: preparation of the record, limits, a table with one row for each fit, and remarks."""
    motion_columns = (("peak", "m/s2"), ("velocity", "m/s"), ("stroke", "mm"), ("end", "mm"))
    changes = [*(f"at {period:.3g} s" for period in fits.own), "rms", "largest"]
    columns = [
        TextColumn("", words=True),
        *(TextColumn(title, unit) for title, unit in motion_columns),
        *(TextColumn(title, "%") for title in changes),
    ]
    rows = [["before", *_numbers(fits.unfitted), *["-"] * len(changes)]]
    for method, motion in fits.fitted.items():
        change = _change(fits, motion)
        shares = [*change["change_at_own_periods"], change["change_rms"], change["change_max"]]
        rows.append([str(method), *_numbers(motion), *(f"{100.0 * share:+.2f}" for share in shares)])
    rows += [[str(method), *["refused"] * (len(columns) - 1)] for method in fits.refused]
    record, reach = fits.record, fits.reach
    return "\n".join(
        [
            f"{record.name}: {record.source}, sha256 {record.sha256}",
            *fits.unfitted.steps,
            f"the table is limited to {1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s",
            "",
            text_table(columns, rows),
            "",
            "changes in the response spectrum: at the periods of the frame, and rms and largest from 0.1 to 2 s",
            *(f"{method}: {motion.fit.done}" for method, motion in fits.fitted.items() if motion.fit is not None),
            *(f"{method}: {reason}" for method, reason in fits.refused.items()),
        ]
    )


def _figure(fits: "StrokeFits") -> "Figure":
    """Histories and spectra, before and after the fit."""
    from bench.figures.record_figure import Spectra, stroke_figure

    motions = {"before": fits.unfitted, **{str(method): motion for method, motion in fits.fitted.items()}}
    done = [motion.fit for motion in fits.fitted.values() if motion.fit is not None]
    spectra = Spectra(done[0].periods, [done[0].spectrum_before, *(fit.spectrum for fit in done)], fits.own)
    histories = [_history(name, motion) for name, motion in motions.items()]
    return stroke_figure(fits.record.name, histories, spectra, (fits.reach.displacement, fits.reach.velocity))


def _write_record(path: Path, fits: "StrokeFits") -> None:
    """Write the chosen fit in full precision as columns that `bench.accelerograms.columns` reads. Raises InvalidInput
    if `path` exists and RockbenchError if it cannot be written.
    """
    import numpy as np

    from bench.unfinished import write_new

    motion, record = fits.chosen, fits.record
    time = np.arange(motion.record.acceleration.size) * motion.record.dt
    comments = [
        "earthquake record fitted to a shake table",
        f"from: {record.name}, {record.source}, {record.format}",
        f"sha256 of the original: {record.sha256}",
        *motion.steps,
        f"begins at {motion.begin_in_record:.9g} s of the original record; starts and ends at rest",
        f"acceleration in m/s2, dt = {motion.record.dt:.12g} s",
    ]
    rows = (f"{t:.12g},{a!r}\n" for t, a in zip(time.tolist(), motion.record.acceleration.tolist(), strict=True))

    def write(unfinished: Path) -> None:
        with unfinished.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(f"# {one_line(comment)}\n" for comment in comments)
            file.write("t [s],a [m/s2]\n")
            file.writelines(rows)

    write_new(path, write)


def _motion(motion: "PreparedMotion") -> dict[str, Any]:
    return {
        "peak_m_s2": motion.peak,
        "peak_velocity_m_s": motion.motion.peak_velocity,
        "peak_displacement_m": motion.motion.peak_displacement,
        "final_velocity_m_s": float(motion.motion.velocity[-1]),
        "final_displacement_m": float(motion.motion.displacement[-1]),
        "factor": motion.factor,
        "begin_s": motion.begin_in_record,
        "dt_s": motion.record.dt,
        "duration_s": motion.record.duration,
        "steps": list(motion.steps),
    }


def _change(fits: "StrokeFits", motion: "PreparedMotion") -> dict[str, Any]:
    from bench.prediction.stroke_fits import change_at, change_over

    if motion.fit is None:
        return {}
    rms, largest = change_over(motion.fit)
    return {
        "own_periods_s": fits.own.tolist(),
        "change_at_own_periods": change_at(motion.fit, fits.own).tolist(),
        "change_rms": rms,
        "change_max": largest,
    }


def _numbers(motion: "PreparedMotion") -> list[str]:
    table = motion.motion
    end = f"{1e3 * float(table.displacement[-1]):.2g}"
    return [number(motion.peak), number(table.peak_velocity), number(1e3 * table.peak_displacement), end]


def _history(name: str, motion: "PreparedMotion") -> "History":
    import numpy as np

    from bench.figures.record_figure import History

    size, dt = motion.record.acceleration.size, motion.record.dt
    time = np.asarray(motion.begin + np.arange(size) * dt, dtype=np.float64)
    return History(name, time, motion.record.acceleration, motion.motion.velocity, motion.motion.displacement)
