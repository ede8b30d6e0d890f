"""`rockbench predict`: what the model expects, without a bench."""

from collections.abc import Callable
from dataclasses import dataclass
from inspect import Signature
from typing import TYPE_CHECKING, Any

from cyclopts import App, Group

from bench.cli import flags
from bench.cli.predict_options import EXIT_CODES, ResultOptions, SpecimenOptions, arguments_of, taken
from bench.cli.predict_records import RECORDS_PREDICTIONS, records_command
from bench.cli.progress import HANDED
from bench.prediction.requests import (
    HistoryRequest,
    MapRequest,
    ModesRequest,
    SineRequest,
    SpectrumRequest,
    SteadyRequest,
)
from bench.progress import Progress, silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.cli.predict_output import Result
    from sim.knowledge import SpecimenKnowledge
    from sim.specimen import Specimen

MOST_HISTORIES = 6
"""Points that a figure of histories can show."""

Make = Callable[[Any, "Specimen", "SpecimenKnowledge", Progress], "Result"]


@dataclass(frozen=True)
class Prediction:
    """A prediction on the command line: its flags come from `request`, and `make` computes it."""

    name: str
    request: type[ModesRequest] | type[SineRequest]
    make: Make
    summary: str
    details: str
    drawable: int | None = None
    """Points that its figure can show, if that has a limit."""


def predict_app() -> App:
    """`rockbench predict`, with one command for each kind of prediction."""
    app = App(name="predict", help="Predict modes, motions and gain coefficients from the model.", version_flags=())
    for prediction in PREDICTIONS:
        app.command(_command(prediction), name=prediction.name)
    for on_records in RECORDS_PREDICTIONS:
        app.command(records_command(on_records), name=on_records.name)
    return app


def _command(prediction: Prediction) -> Callable[..., int]:
    """The function behind a command; its signature is the flags of the request and the common options."""

    def execute(**arguments: Any) -> int:
        return _perform(prediction, arguments, arguments.pop("progress", silent))

    group = Group(f"Parameters of {prediction.name}", sort_key=1)
    asked = flags.arguments_of(prediction.request, group)
    execute.__doc__ = f"{prediction.summary}\n\n{prediction.details}\n\n{EXIT_CODES}"
    execute.__dict__["__signature__"] = Signature(
        [*asked, *arguments_of(SpecimenOptions), *arguments_of(ResultOptions), HANDED]
    )
    return execute


def _perform(prediction: Prediction, arguments: dict[str, Any], progress: Progress) -> int:
    progress("loading the program")
    from bench.cli.predict_inputs import known_from, request_from, specimen_from, warn_of_unusual
    from bench.cli.predict_output import carried_out, check_files

    options = ResultOptions(**taken(arguments, ResultOptions))
    chosen = SpecimenOptions(**taken(arguments, SpecimenOptions))
    request = request_from(prediction.request, arguments)
    known = known_from(chosen.specimen, chosen.restitution_factor)
    specimen = specimen_from(chosen.specimen, chosen.distance, chosen.restitution_factor, known=known)
    if specimen.label is not None and arguments.get("beta") is None and not isinstance(request, MapRequest):
        request = request.model_copy(update={"beta": (specimen.label,)})
    check_files(options)
    if options.plot is not None and prediction.drawable is not None and isinstance(request, SineRequest):
        points = len(request.omega) * len(request.beta)
        if points > prediction.drawable:
            allowed = f"at most {prediction.drawable} points fit in this figure; ask for fewer"
            raise InvalidInput("--plot", f"{points} points", allowed)
    warn_of_unusual(request, specimen)
    return carried_out(lambda: prediction.make(request, specimen, known, progress), options, progress)


def _modes(request: ModesRequest, specimen: "Specimen", _known: "SpecimenKnowledge", _: Progress) -> "Result":
    from bench.cli.predict_modes import modes

    return modes(request, specimen)


def _history(
    request: HistoryRequest, specimen: "Specimen", _known: "SpecimenKnowledge", progress: Progress
) -> "Result":
    from bench.cli.predict_history import history

    return history(request, specimen, progress)


def _steady(request: SteadyRequest, specimen: "Specimen", known: "SpecimenKnowledge", progress: Progress) -> "Result":
    from bench.cli.predict_gain import steady

    return steady(request, specimen, known, progress)


def _spectrum(
    request: SpectrumRequest, specimen: "Specimen", known: "SpecimenKnowledge", progress: Progress
) -> "Result":
    from bench.cli.predict_gain import spectrum

    return spectrum(request, specimen, known, progress)


def _map(request: MapRequest, specimen: "Specimen", known: "SpecimenKnowledge", progress: Progress) -> "Result":
    from bench.cli.predict_gain import gain_map

    return gain_map(request, specimen, known, progress)


PREDICTIONS = (
    Prediction(
        "modes",
        ModesRequest,
        _modes,
        "Frequencies and shapes of the bare frame and of the linearised coupled system.",
        "A mode with negative stiffness is divergent: it has a rate of growth and no frequency. The figure is like the "
        "paper's Fig. 3; with more than five stiffnesses it shows curves over the stiffness.",
    ),
    Prediction(
        "history",
        HistoryRequest,
        _history,
        "Time histories of drift, u1 and theta, with the sine switched on at rest or in the steady state.",
        "From rest the block may overturn, also where the steady motion is stable: the history then ends there, and "
        "says so. With --steady: whole periods of each steady motion that exists. The figure is like the paper's "
        "Fig. 5.",
    ),
    Prediction(
        "steady",
        SteadyRequest,
        _steady,
        "Steady motions at single points: gain coefficients, peaks, impacts, Floquet multipliers.",
        "Motions of the drive's period are solved for, not waited for. Up to two exist at a point: the block rocks, or "
        "it never lifts. Each is an entry, its alpha_2 with a band: expanded uncertainty (k = 2) to first order, or "
        "95 % of a Monte Carlo with --members. The figure shows two periods of each.",
        drawable=MOST_HISTORIES,
    ),
    Prediction(
        "spectrum",
        SpectrumRequest,
        _spectrum,
        "Gain spectra: alpha_1 and alpha_2 against frequency for each stiffness, both layers.",
        "Every alpha_2 has a band, as in `steady`. The figure is like the paper's Fig. 6, without measurements.",
    ),
    Prediction(
        "map",
        MapRequest,
        _map,
        "Gain maps: alpha_1 and alpha_2 over frequency and stiffness, both layers, with stability.",
        "The figure is like the paper's Fig. 4: surfaces and contour maps.",
    ),
)
