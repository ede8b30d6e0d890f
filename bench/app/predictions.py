"""Predictions for scripts and notebooks: `bench.predict`; docs/python.md describes it."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.reference import RecordReference
from bench.app.measurements import Quantity, Samples
from bench.config.declared import declared
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_specimen
from bench.config.toml import read_configuration, read_table
from bench.config.validation import validated
from bench.prediction.gain_map import map_table
from bench.prediction.requests import MapRequest, ModesRequest, SeismicRequest, SteadyRequest
from bench.prediction.seismic import gains_table, seismic_curves
from bench.prediction.steady import predict_spectra, steady_table
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.knowledge import SpecimenKnowledge
from sim.linear import bare_modes, coupled_modes
from sim.loading import load_model
from sim.parameters import Parameters
from sim.specimen import Specimen

P = TypeVar("P", bound=Parameters)
File = str | PathLike[str]
Numbers = float | str | Sequence[float] | NDArray[Any]
"""A number, several numbers, or a range as on the command line ("12:21:181")."""
Record = File | Accelerogram | tuple[NDArray[Any], float]
"""An earthquake record: a file, `FILE@unit=g`, `synthetic:NAME`, or accelerations [m/s2] and their time step [s]."""

OF_SINE = ("amplitude_factor", "members")
"""Names of the options of a prediction for a sine."""

_OF_BRANCH = {
    "alpha_1": ("alpha_1", "1"),
    "alpha_2": ("alpha_2", "1"),
    "alpha_2_low": ("alpha_2_low", "1"),
    "alpha_2_high": ("alpha_2_high", "1"),
    "u1_max": ("u1_max_m", "m"),
    "drift_max": ("drift_max_m", "m"),
    "theta_max": ("theta_max_rad", "rad"),
    "multiplier": ("floquet_modulus", "1"),
}
"""Column and unit of each field of a `Branch`."""


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch of steady motions; arrays of shape (n_beta, n_omega), NaN where the motion does not exist. An axis
    specified by a single number is dropped.

    alpha_2_low, alpha_2_high : uncertainty band of alpha_2; NaN unless requested.
    multiplier : largest magnitude of the Floquet multipliers.
    """

    alpha_1: Quantity
    alpha_2: Quantity
    alpha_2_low: Quantity
    alpha_2_high: Quantity
    stable: Quantity
    u1_max: Quantity
    drift_max: Quantity
    theta_max: Quantity
    multiplier: Quantity


@dataclass(frozen=True, eq=False)
class SteadyPrediction:
    """Steady motions under a sine, with the block rocking and at rest. At a point, both, one or neither may exist."""

    omega: Quantity
    beta: Quantity
    rocking: Branch
    resting: Branch


@dataclass(frozen=True, eq=False)
class SeismicPrediction:
    """Gain under an earthquake record; arrays of shape (n_beta,), or () for a single stiffness, NaN where the block
    overturned.

    `motion` is the acceleration of the table: the record after the requested trimming, filtering, scaling and fitting.
    """

    beta: Quantity
    alpha_1: Quantity
    alpha_2: Quantity
    alpha_2_low: Quantity
    alpha_2_high: Quantity
    overturned: Quantity
    drift_max: Quantity
    bare_drift_max: Quantity
    motion: Samples


@dataclass(frozen=True, eq=False)
class Modes:
    """Undamped modes; the last axis of the shapes is u1, u2, theta. The first axis of `omega` and `shapes` is dropped
    for a single stiffness.

    omega : circular frequencies, shape (n_beta, 3); a negative entry is minus the growth rate of a divergent mode.
    shapes : mode shapes, shape (n_beta, 3, 3).
    bare_omega, bare_shapes : those of the bare frame, of shapes (2,) and (2, 2).
    """

    beta: Quantity
    omega: Quantity
    shapes: NDArray[np.float64]
    bare_omega: Quantity
    bare_shapes: NDArray[np.float64]


@overload
def predict(
    specimen: Specimen | File | None = None,
    *,
    omega: Numbers,
    beta: Numbers | None = None,
    configuration: BenchConfiguration | File | None = None,
    band: bool = False,
    **options: Any,
) -> SteadyPrediction: ...
@overload
def predict(
    specimen: Specimen | File | None = None,
    *,
    record: Record,
    beta: Numbers | None = None,
    configuration: BenchConfiguration | File | None = None,
    **options: Any,
) -> SeismicPrediction: ...
@overload
def predict(
    specimen: Specimen | File | None = None,
    *,
    beta: Numbers | None = None,
    configuration: BenchConfiguration | File | None = None,
) -> Modes: ...
def predict(
    specimen: Specimen | File | None = None,
    *,
    omega: Numbers | None = None,
    beta: Numbers | None = None,
    record: Record | None = None,
    configuration: BenchConfiguration | File | None = None,
    band: bool = False,
    **options: Any,
) -> SteadyPrediction | SeismicPrediction | Modes:
    """Predict steady motions at `omega` [rad/s], the gain under a `record`, or, without either, the modes. Raises
    InvalidInput for invalid arguments.

    specimen : a Specimen, a TOML file, or a specimen file (.json); by default the specimen of the `configuration` or of
        the paper.
    beta : labels of the springs; by default the label of the specimen.
    band : adds the first-order uncertainty band of alpha_2.
    options : for a sine `amplitude_factor` and `members`, for a record the fields of
        `bench.prediction.requests.SeismicRequest`. `members` adds the uncertainty band from a Monte Carlo simulation
        with that many specimens.
    """
    chosen, known, bench = _known(specimen, configuration)
    if beta is None and chosen.label is None:
        raise InvalidInput("beta", None, "specify one or more spring labels, k_C/k1")
    if omega is not None and record is not None:
        raise InvalidInput("record", record, "specify omega or record, not both")
    options["beta"] = chosen.label if beta is None else beta
    allowed = list(SeismicRequest.model_fields) if record is not None else [*OF_SINE] if omega is not None else []
    for name in set(options) - {"beta", *allowed}:
        raise InvalidInput(
            name, options[name], f"the options for this prediction are {', '.join(allowed) or 'omega and record'}"
        )
    with python_names():
        load_model()
        if omega is not None:
            return _steady(chosen, known, {"omega": omega, **options}, band)
        if record is not None:
            return _seismic(chosen, known, options, _accelerogram(record), bench)
        return _modes(chosen, options)


def _steady(specimen: Specimen, known: SpecimenKnowledge, given: Mapping[str, Any], band: bool) -> SteadyPrediction:
    request = valid(SteadyRequest, given)
    banded = known if band or request.members else None
    if len(request.omega) > 1 and len(request.beta) > 1:
        table = map_table(specimen, MapRequest(**request.model_dump()), banded)
    else:
        table = steady_table(predict_spectra(specimen, request), known=banded, members=request.members)
    rows = _places(table["beta"].values, request.beta)
    columns = _places(table["omega_rad_s"].values, request.omega)
    beta, omega = _index(given["beta"]), _index(given["omega"])

    def branch(name: str) -> Branch:
        here = table["layer"].values == name

        def grid(column: str, unit: str, absent: float | bool = np.nan) -> Quantity:
            values = np.full((len(request.beta), len(request.omega)), absent)
            if column in table:
                values[rows[here], columns[here]] = table[column].values[here]
            return Quantity(np.asarray(values[beta, omega]), unit)

        fields = {field: grid(*column) for field, column in _OF_BRANCH.items()}
        return Branch(**fields, stable=grid("stable", "", absent=False))

    return SteadyPrediction(
        omega=Quantity(np.asarray(np.array(request.omega)[omega]), "rad/s"),
        beta=Quantity(np.asarray(np.array(request.beta)[beta]), "1"),
        rocking=branch("rocking"),
        resting=branch("resting"),
    )


def _seismic(
    specimen: Specimen,
    known: SpecimenKnowledge,
    given: Mapping[str, Any],
    record: Accelerogram,
    configuration: BenchConfiguration,
) -> SeismicPrediction:
    request = valid(SeismicRequest, given)
    (curve,) = seismic_curves(specimen, [record], request, configuration, known)
    table = gains_table([curve])
    # the curve has its stiffnesses in ascending order
    order = np.argsort(np.argsort(request.beta))[_index(given["beta"])]

    def column(name: str, unit: str = "1") -> Quantity:
        values = table[name].values if name in table else np.full(len(request.beta), np.nan)
        return Quantity(np.asarray(values[order]), unit)

    motion = curve.prepared.record
    time = Quantity(np.arange(motion.acceleration.size) * motion.dt, "s")
    return SeismicPrediction(
        beta=column("beta"),
        alpha_1=column("alpha_1"),
        alpha_2=column("alpha_2"),
        alpha_2_low=column("alpha_2_low"),
        alpha_2_high=column("alpha_2_high"),
        overturned=column("toppled", ""),
        drift_max=column("drift_max_m", "m"),
        bare_drift_max=column("bare_drift_max_m", "m"),
        motion=Samples(motion.acceleration, "m/s2", time, "acceleration"),
    )


def _modes(specimen: Specimen, given: Mapping[str, Any]) -> Modes:
    betas, chosen = valid(ModesRequest, given).beta, _index(given["beta"])
    bare, coupled = bare_modes(specimen.frame), [coupled_modes(specimen.coupled(beta)) for beta in betas]
    return Modes(
        beta=Quantity(np.asarray(np.array(betas)[chosen]), "1"),
        omega=Quantity(np.stack([modes.omega for modes in coupled])[chosen], "rad/s"),
        shapes=np.stack([modes.shapes.T for modes in coupled])[chosen],
        bare_omega=Quantity(bare.omega, "rad/s"),
        bare_shapes=bare.shapes.T,
    )


def _places(values: NDArray[np.float64], axis: Sequence[float]) -> NDArray[np.intp]:
    """Index in `axis`, which has no duplicates, of each of `values`."""
    order = np.argsort(axis)
    return order[np.searchsorted(np.array(axis), values, sorter=order)]


def _index(given: Any) -> int | slice:
    """Index into an axis: 0 for a single number, which drops the axis; else the whole axis."""
    return 0 if np.ndim(given) == 0 and not isinstance(given, str) else slice(None)


def valid(model: type[P], given: Mapping[str, Any]) -> P:
    """Validated parameters from numbers, arrays and strings; a single value becomes a list if the field is a list."""
    plain: dict[str, Any] = {}
    for name, value in given.items():
        plain[name] = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    for entry in declared(model):
        value = plain.get(entry.name)
        if entry.many and value is not None and not isinstance(value, list | tuple):
            plain[entry.name] = [value]
    return validated(model, plain)


def configured(given: BenchConfiguration | File | None) -> BenchConfiguration:
    if given is None:
        return BenchConfiguration()
    return given if isinstance(given, BenchConfiguration) else read_configuration(given)


def _known(
    given: Specimen | File | None, configuration: BenchConfiguration | File | None
) -> tuple[Specimen, SpecimenKnowledge, BenchConfiguration]:
    """The specimen for a prediction, its uncertainty, and the configuration of the bench."""
    bench = configured(configuration)
    if given is None:
        return bench.known_specimen, bench.known, bench
    assumed, identified = bench.specimen, Identified()
    if isinstance(given, Specimen):
        assumed = given
    elif Path(given).suffix == ".json":
        identified = read_specimen(Path(given))
    else:
        assumed = validated(Specimen, read_table(Path(given), "specimen"))
    return identified.applied(assumed), bench.known.model_copy(update={"identified": identified}), bench


def _accelerogram(given: Record) -> Accelerogram:
    match given:
        case Accelerogram():
            return given
        case str() | PathLike():
            return RecordReference.parse(str(given)).read()
        case tuple():
            acceleration, dt = np.asarray(given[0], np.float64), float(given[1])
            digest = sha256(acceleration.tobytes()).hexdigest()
            return Accelerogram("array", acceleration, dt, "array", "array", "m/s2", digest, {})
        case _:
            allowed = "it must be a reference such as kobe.csv@unit=g, or accelerations [m/s2] and their time step [s]"
            raise InvalidInput("record", given, allowed)


@contextmanager
def python_names() -> Generator[None]:
    """Replace command-line flags in error messages by the names of Python arguments."""
    try:
        yield
    except InvalidInput as refused:
        if not refused.item.startswith("--"):
            raise
        raise InvalidInput(refused.item[2:].replace("-", "_"), refused.value, refused.allowed) from None
