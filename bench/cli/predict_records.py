"""The predictions on the command line that take earthquake records: `rockbench predict seismic` and `band-study`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import Parameter as Argument
from inspect import Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from bench.cli import flags
from bench.cli.predict_options import EXIT_CODES, ResultOptions, SpecimenOptions, arguments_of, taken
from bench.cli.progress import HANDED
from bench.prediction.requests import BandStudyRequest, RecordsRequest, SeismicRequest
from bench.progress import Progress, silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.accelerograms.accelerogram import Accelerogram
    from bench.cli.predict_output import Result
    from bench.config.model import BenchConfiguration
    from sim.knowledge import SpecimenKnowledge
    from sim.specimen import Specimen

Make = Callable[
    [Any, "Specimen", "SpecimenKnowledge", "Sequence[Accelerogram]", "BenchConfiguration", Progress], "Result"
]

_FILES = Argument(
    "files",
    Argument.VAR_POSITIONAL,
    annotation=Annotated[
        str,
        Parameter(
            name="FILE",
            metavar="FILE",
            help="Records, before the flags: FILE, FILE@KEY=VALUE,... with the keys unit, dt, channel, column, name, "
            "or synthetic:NAME[:SEED]. Without any: the seven synthetic ones.",
        ),
    ],
)
CONFIG = Argument(
    "config",
    Argument.KEYWORD_ONLY,
    default=None,
    annotation=Annotated[
        Path | None,
        Parameter(
            name="--config",
            metavar="FILE",
            help="Configuration of the bench (TOML): band and stroke of its table, its specimen.",
            show_default="the paper's specimen on the simulated bench",
        ),
    ],
)


@dataclass(frozen=True)
class RecordsPrediction:
    """A prediction on the command line: its flags come from `request`, and `make` computes it."""

    name: str
    request: type[RecordsRequest]
    make: Make
    summary: str
    details: str
    drawable: int
    """Records that its figure can show."""


def records_command(prediction: RecordsPrediction) -> Callable[..., int]:
    """The function behind a command; its signature is records, flags of the request, and the common options."""

    # not named as in the signature: cyclopts would take this annotation for that one
    def execute(*named: str, **arguments: Any) -> int:
        return _perform(prediction, named, arguments, arguments.pop("progress", silent))

    group = Group(f"Parameters of {prediction.name}", sort_key=1)
    asked = flags.arguments_of(prediction.request, group)
    execute.__doc__ = f"{prediction.summary}\n\n{prediction.details}\n\n{EXIT_CODES}"
    execute.__dict__["__signature__"] = Signature(
        [_FILES, *asked, CONFIG, *arguments_of(SpecimenOptions), *arguments_of(ResultOptions), HANDED]
    )
    return execute


def _perform(prediction: RecordsPrediction, files: Sequence[str], arguments: dict[str, Any], progress: Progress) -> int:
    progress("loading the program")
    from bench.cli.inputs import configuration_from
    from bench.cli.predict_inputs import known_from, request_from, specimen_from, warn_of_unusual
    from bench.cli.predict_output import carried_out, check_files

    options = ResultOptions(**taken(arguments, ResultOptions))
    chosen = SpecimenOptions(**taken(arguments, SpecimenOptions))
    configuration = configuration_from(arguments.pop("config", None), None)
    request = request_from(prediction.request, arguments)
    known = known_from(chosen.specimen, chosen.restitution_factor, configuration)
    assumed = configuration.specimen
    specimen = specimen_from(chosen.specimen, chosen.distance, chosen.restitution_factor, assumed, known)
    check_files(options)
    progress("reading the records")
    records = records_from(files)
    if options.plot is not None and len(records) > prediction.drawable:
        allowed = f"at most {prediction.drawable} fit in this figure; give fewer"
        raise InvalidInput("--plot", f"{len(records)} records", allowed)
    warn_of_unusual(request, specimen)
    return carried_out(
        lambda: prediction.make(request, specimen, known, records, configuration, progress), options, progress
    )


def records_from(files: Sequence[str]) -> "tuple[Accelerogram, ...]":
    """The records that were named, or the seven synthetic ones. Raises InvalidInput."""
    from bench.accelerograms.reference import RecordReference, read_records
    from bench.accelerograms.synthetic import NAMES

    named = files or [f"synthetic:{name}" for name in NAMES]
    return read_records([RecordReference.parse(text) for text in named])


def _seismic(
    request: SeismicRequest,
    specimen: "Specimen",
    known: "SpecimenKnowledge",
    records: "Sequence[Accelerogram]",
    configuration: "BenchConfiguration",
    progress: Progress,
) -> "Result":
    from bench.cli.predict_seismic import seismic

    return seismic(request, specimen, known, records, configuration, progress)


def _band_study(
    request: BandStudyRequest,
    specimen: "Specimen",
    _known: "SpecimenKnowledge",
    records: "Sequence[Accelerogram]",
    configuration: "BenchConfiguration",
    progress: Progress,
) -> "Result":
    from bench.cli.predict_seismic import study

    return study(request, specimen, records, configuration, progress)


RECORDS_PREDICTIONS = (
    RecordsPrediction(
        "seismic",
        SeismicRequest,
        _seismic,
        "Gain curves under earthquake records: alpha_1 and alpha_2 against the stiffness.",
        "Each record is trimmed, limited to the band of the table, scaled to its peak, and on request fitted to the "
        "stroke; everything starts at rest. A block that topples has no gain but a time. The figure is like the "
        "paper's Fig. 8(a) and 9(a).",
        drawable=28,
    ),
    RecordsPrediction(
        "band-study",
        BandStudyRequest,
        _band_study,
        "Gain and toppling under earthquake records, against the lower end of the table's band.",
        "As `seismic`, each record scaled to its peak at every lower end. The figure has a panel for each record.",
        drawable=15,
    ),
)
