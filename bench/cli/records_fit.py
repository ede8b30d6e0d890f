"""`rockbench records fit`: a record made to fit the stroke of the bench, and what that does to its spectrum."""

from collections.abc import Callable
from inspect import Parameter as Argument
from inspect import Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Group, Parameter

from bench.cli import flags
from bench.cli.predict_options import ResultOptions
from bench.cli.predict_records import CONFIG
from bench.cli.progress import HANDED
from bench.cli.refusal import fail
from bench.prediction.requests import StrokeFitRequest
from bench.progress import Progress, silent
from sim.errors import InvalidInput, RockbenchError

if TYPE_CHECKING:
    from bench.prediction.stroke_fits import StrokeFits

_HELP = (
    "Make a record fit the stroke and the velocity of the configured bench, at rest at both ends.\n\n"
    "The record is scaled in time (--length-ratio), trimmed, limited to a band, scaled to a peak, then fitted: by the "
    "least change below 2 Hz, by a high-pass, or by both to compare. Stroke, velocity and the change of the response "
    "spectrum are told. Nothing is written unless asked for. The exit code is 0 when it was made to fit, 1 when "
    "writing failed, 2 when something was refused. Files that exist are never overwritten."
)


def register_fit(app: App) -> None:
    """Put the command on the app of `rockbench records`."""
    app.command(_command(), name="fit")


def _command() -> Callable[..., int]:
    # not named as in the signature: cyclopts would take this annotation for that one
    def execute(named: str, /, **arguments: Any) -> int:
        return _perform(named, arguments, arguments.pop("progress", silent))

    group = Group("Parameters of fit", sort_key=1)
    execute.__doc__ = _HELP
    execute.__dict__["__signature__"] = Signature(
        [_FILE, *flags.arguments_of(StrokeFitRequest, group), CONFIG, _OUT, _PLOT, _JSON, HANDED]
    )
    return execute


def _option(name: str, kind: Any, default: Any, parameter: Parameter) -> Argument:
    return Argument(name, Argument.KEYWORD_ONLY, default=default, annotation=Annotated[kind, parameter])


_FILE = Argument(
    "file",
    Argument.POSITIONAL_ONLY,
    annotation=Annotated[
        str,
        Parameter(
            name="FILE",
            metavar="FILE",
            help="A record: FILE, FILE@KEY=VALUE,... with the keys unit, dt, channel, column, name; or "
            "synthetic:NAME[:SEED].",
        ),
    ],
)
_OUT = _option(
    "out",
    Path | None,
    None,
    Parameter(
        name="--out",
        metavar="FILE",
        help="Write the fitted record as columns t,a; that of least change unless --method says otherwise.",
    ),
)
_PLOT = _option(
    "plot",
    Path | None,
    None,
    Parameter(name="--plot", metavar="FILE", help="Draw histories and spectra, before and after: .png, .pdf or .svg."),
)
_JSON = _option(
    "json",
    bool,
    False,
    Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object and nothing else."),
)


def _perform(file: str, arguments: dict[str, Any], progress: Progress) -> int:
    progress("loading the program")
    from bench.accelerograms.reference import RecordReference
    from bench.cli.inputs import configuration_from
    from bench.cli.predict_inputs import request_from, warn_of_unusual
    from bench.cli.predict_output import check_files
    from bench.prediction.stroke_fits import stroke_fits

    out, plot, as_json = arguments.pop("out", None), arguments.pop("plot", None), arguments.pop("json", False)
    configuration = configuration_from(arguments.pop("config", None), None)
    request = request_from(StrokeFitRequest, arguments)
    check_files(ResultOptions(out=out, plot=plot))
    warn_of_unusual(request, configuration.known_specimen)
    progress("fitting the record to the stroke")
    fits = stroke_fits(RecordReference.parse(file).read(), request, configuration)
    try:
        _write(fits, out, plot)
    except InvalidInput:
        raise
    except (RockbenchError, OSError) as error:
        fail(error)
        return 1
    if as_json:
        import json

        from bench.cli.records_fit_output import content_of
        from bench.prediction.files import provenance

        print(json.dumps({**content_of(fits), **provenance(request, configuration.known_specimen)}, allow_nan=False))
    else:
        from bench.cli.records_fit_output import text_of

        print(text_of(fits))
    return 0


def _write(fits: "StrokeFits", out: Path | None, plot: Path | None) -> None:
    from bench.cli.records_fit_output import figure_of, write_record

    figure = figure_of(fits) if plot is not None else None
    if out is not None:
        write_record(out, fits)
    if plot is not None and figure is not None:
        from bench.report.style import write_figure

        write_figure(plot, figure)
