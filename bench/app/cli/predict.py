"""`rockbench predict`: predictions of the model, without a bench."""

from collections.abc import Mapping
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from bench.app.cli.inputs import (
    configuration_from,
    known_from,
    records_from,
    request_from,
    specimen_from,
    warn_of_unusual,
)
from bench.app.cli.options import BenchFile, Handed, ResultOptions, SpecimenOptions, with_flags
from bench.app.cli.output import check_files, deliver
from bench.prediction.requests import (
    AttractorRequest,
    BandStudyRequest,
    HistoryRequest,
    MapRequest,
    ModesRequest,
    OnTableRequest,
    RecordsRequest,
    SeismicRequest,
    SineRequest,
    SpectrumRequest,
    StabilityRequest,
    SteadyRequest,
)
from bench.progress import silent
from sim.errors import InvalidInput
from sim.extras import require
from sim.parameters import Parameters

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bench.accelerograms.accelerogram import Accelerogram
    from bench.config.model import BenchConfiguration
    from sim.knowledge import SpecimenKnowledge
    from sim.specimen import Specimen

MOST_HISTORIES = 6
"""Maximum number of points in a figure of histories."""

_EXIT_CODES = (
    "The exit code is 0 if the prediction succeeded, 1 if it failed, 2 if an input was refused. Existing "
    "files are never overwritten."
)

_Records = Annotated[
    str,
    Parameter(
        name="FILE",
        metavar="FILE",
        help="Records, before the flags: FILE, FILE@KEY=VALUE,... with the keys unit, dt, channel, column and name, "
        "or synthetic:NAME[:SEED]. Default: the seven synthetic ones.",
    ),
]


@dataclass(frozen=True)
class Subject:
    """Specimen of a prediction and its uncertainty; for a prediction under records, also the bench and the records."""

    specimen: "Specimen"
    known: "SpecimenKnowledge"
    configuration: "BenchConfiguration"
    records: "tuple[Accelerogram, ...]" = ()
    unfinished: "Path | None" = None
    """Folder for an unfinished result, from which the computation continues."""


def _sine(
    request_type: type[ModesRequest | SineRequest | OnTableRequest],
    function: str,
    documentation: str,
    drawable: int | None = None,
) -> "Callable[..., int]":
    """A command with the flags of `request_type`, whose result `function` ("module:name" in this package) computes. Its
    figure shows at most `drawable` points.
    """

    def command(
        typed: Mapping[str, Any],
        *,
        chosen: SpecimenOptions = SpecimenOptions(),  # noqa: B008 - immutable
        options: ResultOptions = ResultOptions(),  # noqa: B008 - immutable
        progress: Handed = silent,
    ) -> int:
        progress("loading the program")
        from bench.config.model import BenchConfiguration

        request = request_from(request_type, typed)
        known = known_from(chosen.specimen, chosen.restitution_factor)
        specimen = specimen_from(chosen.specimen, chosen.distance, chosen.restitution_factor, known=known)
        if specimen.label is not None and typed.get("beta") is None and not isinstance(request, MapRequest):
            request = request.model_copy(update={"beta": (specimen.label,)})
        check_files(options)
        _check_scheduler(request)
        if options.plot is not None and drawable is not None and isinstance(request, SineRequest):
            points = len(request.omega) * len(request.beta)
            if points > drawable:
                allowed = f"at most {drawable} points fit in this figure; specify fewer"
                raise InvalidInput("--plot", f"{points} points", allowed)
        warn_of_unusual(request, specimen)
        make = resolve_name(f"bench.app.cli.{function}")
        subject = Subject(specimen, known, BenchConfiguration(), unfinished=_unfinished(options))
        return deliver(lambda: make(request, subject, progress), options, progress)

    command.__doc__ = f"{documentation}\n\n{_EXIT_CODES}"
    return with_flags(request_type, f"Parameters of {function.partition(':')[2].removeprefix('gain_')}", command)


def _check_scheduler(request: Parameters) -> None:
    """Raise MissingExtra if the request names a scheduler and its client is not installed."""
    if getattr(request, "scheduler", None) is not None:
        require("distributed", "--scheduler")


def _unfinished(options: ResultOptions) -> "Path | None":
    """Folder for an unfinished result, next to the file of --out or --csv; None without such a file."""
    path = options.out or options.csv
    return None if path is None else path.with_name(f".{path.name}.unfinished")


def _under_records(
    request_type: type[RecordsRequest], function: str, documentation: str, drawable: int
) -> "Callable[..., int]":
    """A command with the flags of `request_type`, whose result `function` of `predict_seismic` computes. Its figure
    shows at most `drawable` records.
    """

    def command(
        typed: Mapping[str, Any],
        *files: _Records,
        config: BenchFile = None,
        chosen: SpecimenOptions = SpecimenOptions(),  # noqa: B008 - immutable
        options: ResultOptions = ResultOptions(),  # noqa: B008 - immutable
        progress: Handed = silent,
    ) -> int:
        progress("loading the program")
        configuration = configuration_from(config, None)
        request = request_from(request_type, typed)
        known = known_from(chosen.specimen, chosen.restitution_factor, configuration)
        assumed = configuration.specimen
        specimen = specimen_from(chosen.specimen, chosen.distance, chosen.restitution_factor, assumed, known)
        check_files(options)
        _check_scheduler(request)
        progress("reading the records")
        records = records_from(files)
        if options.plot is not None and len(records) > drawable:
            allowed = f"at most {drawable} fit in this figure; specify fewer"
            raise InvalidInput("--plot", f"{len(records)} records", allowed)
        warn_of_unusual(request, specimen)
        make = resolve_name(f"bench.app.cli.predict_seismic:{function}")
        subject = Subject(specimen, known, configuration, records)
        return deliver(lambda: make(request, subject, progress), options, progress)

    command.__doc__ = f"{documentation}\n\n{_EXIT_CODES}"
    return with_flags(request_type, f"Parameters of {function.replace('_', '-')}", command)


modes = _sine(
    ModesRequest,
    "predict_sine:modes",
    "Frequencies and shapes of the bare frame and of the linearised coupled system.\n\n"
    "A mode with negative stiffness is divergent: it has a growth rate instead of a frequency. The figure is like the "
    "paper's Fig. 3; with more than five stiffnesses it shows curves against stiffness.",
)
history = _sine(
    HistoryRequest,
    "predict_sine:history",
    "Time histories of drift, u1 and theta, with the sine switched on at rest or in the steady state.\n\n"
    "From rest the block may overturn even where the steady motion is stable; the history then ends at that time and "
    "is marked. With --steady, whole periods of every existing steady motion are computed. The figure is like the "
    "paper's Fig. 5.",
)
steady = _sine(
    SteadyRequest,
    "predict_sine:steady",
    "Steady motions at single points: gain coefficients, peaks, impacts and Floquet multipliers.\n\nThe "
    "periodic motions are solved for directly, without waiting for transients to decay. Up to two exist "
    "at a point: one in which the block rocks, and one in which it never lifts. Each is listed; with the "
    "solver taylor, its alpha_2 has an uncertainty band: expanded uncertainty (k = 2) to first order, or the "
    "95 % interval of a Monte Carlo simulation with --members. The figure shows two periods of each.",
    drawable=MOST_HISTORIES,
)
spectrum = _sine(
    SpectrumRequest,
    "predict_sine:spectrum",
    "Gain spectra: alpha_1 and alpha_2 against frequency for each stiffness, on both branches.\n\n"
    "With the solver taylor, every alpha_2 has a band, as in `steady`. The figure is like the paper's Fig. 6, without "
    "measurements.",
)
gain_map = _sine(
    MapRequest,
    "predict_sine:gain_map",
    "Gain maps: alpha_1 and alpha_2 against frequency and stiffness on both branches, with stability.\n\n"
    "The figure is like the paper's Fig. 4: surfaces and contour maps.",
)
stability = _sine(
    StabilityRequest,
    "predict_on_table:stability",
    "Frequencies at which rocking motions become stable or unstable, on fixed ground and on a table.\n\n"
    "The block pushes the table, which changes how a disturbance grows or decays: a motion may be stable on the table "
    "and unstable on fixed ground. The drive keeps the table's motion a pure sine up to the harmonic --harmonics, but "
    "does not react within a period. The boundaries are listed with their uncertainty due to the specimen and their "
    "sensitivities to its parameters, the amplitude and the mass of the table; --csv, --json and --plot contain the "
    "multipliers of every point. With several amplitudes, the figure shows the boundaries against stiffness, or "
    "against amplitude for a single stiffness.",
)
attractor = _sine(
    AttractorRequest,
    "predict_on_table:attractor",
    "Long-term motions on a table, where the periodic rocking motion is unstable: period, peaks and falls.\n\n"
    "The motion is simulated from the disturbed orbit over --cycles cycles; the drive keeps the table's harmonics at "
    "their requested values on average. The motion repeats after several cycles, does not repeat, or ends with a fall. "
    "The ranges of the peaks and the share of falls are computed with randomly drawn specimens. With many "
    "frequencies, the figure is a bifurcation diagram.",
)
seismic = _under_records(
    SeismicRequest,
    "seismic",
    "Gain curves under earthquake records: alpha_1 and alpha_2 against the stiffness.\n\nEach record is trimmed, "
    "limited to the table's band, if any, scaled to the peak --peak-factor, and on request fitted to the stroke; "
    "motions start at rest. For a block that topples, the time of toppling is given instead of a gain. The figure is "
    "like the paper's Figs. 8(a) and 9(a).",
    drawable=28,
)
band_study = _under_records(
    BandStudyRequest,
    "band_study",
    "Gain and toppling under earthquake records, against the lower end of the table's band.\n\nLike `seismic`, with "
    "each record limited to each band in turn and scaled to the same peak. The figure has a panel for each record.",
    drawable=15,
)
