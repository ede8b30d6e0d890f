"""The protocols that the command line offers: one row each."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

from protocols.earthquake.parameters import EarthquakeParameters
from protocols.harmonic.parameters import HarmonicParameters
from protocols.identify.parameters import IdentifyParameters
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.events import Subscriber
    from bench.session import Experiment

Progress = Callable[[TextIO, bool], "AbstractContextManager[Subscriber]"]
"""Shows a run on a stream; the second argument says whether a person answers its questions there."""


def _live(stream: TextIO, person_answers: bool) -> "AbstractContextManager[Subscriber]":
    from bench.cli.console import progress_on

    return progress_on(stream, person_answers)


def _always(summary: Mapping[str, Any]) -> bool:  # noqa: ARG001 - whatever was found, it was carried out
    return True


@dataclass(frozen=True)
class Entry:
    """A protocol on the command line: its flags come from `parameters`, and `campaign` makes it from an instance.

    `passed` turns the summary of a run that was carried out into its exit code: 0, or 1 when it is False. `positional`
    names the parameter that is given by place.
    """

    name: str
    summary: str
    details: str
    parameters: type[Parameters]
    campaign: Callable[[Any], "Experiment"]
    progress: Progress = _live
    passed: Callable[[Mapping[str, Any]], bool] = _always
    positional: str | None = None


def _harmonic(parameters: HarmonicParameters) -> "Experiment":
    from protocols.harmonic.campaign import HarmonicCampaign

    return HarmonicCampaign(parameters)


def _identify(parameters: IdentifyParameters) -> "Experiment":
    from protocols.identify.experiment import Identification

    return Identification(parameters)


def _earthquake(parameters: EarthquakeParameters) -> "Experiment":
    from protocols.earthquake.campaign import EarthquakeCampaign

    return EarthquakeCampaign(parameters)


CATALOGUE = (
    Entry(
        name="harmonic",
        summary="Steady sine tests of the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
        details=(
            "Tests the bare frame at every frequency, then the coupled frame at every frequency and stiffness, and "
            "compares the measured gain of the peak drift with the predicted one. Without options: the campaign of the "
            "paper on the simulated bench."
        ),
        parameters=HarmonicParameters,
        campaign=_harmonic,
    ),
    Entry(
        name="identify",
        summary="Identify the table: what acceleration a volt of drive makes at each frequency.",
        details=(
            "Plays multisines with random phases at low level with the specimen on the table, after probes that need "
            "nothing to be known of it, and tells response, noise and nonlinear distortion apart. The result, "
            "table_model.json, is what `table_model` in the configuration of other runs names. Without options: the "
            "bare frame, over the band that replicating records takes."
        ),
        parameters=IdentifyParameters,
        campaign=_identify,
    ),
    Entry(
        name="earthquake",
        summary="Earthquake records on the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
        details=(
            "Each record is limited to a band, scaled, and fitted to the stroke; the table learns it with the bare "
            "frame, and it is played with every spring. The measured gain of the peak drift is compared with the one "
            "predicted for the motion that the table really made. A block that topples is a result. Records are files, "
            "or synthetic:NAME."
        ),
        parameters=EarthquakeParameters,
        campaign=_earthquake,
        positional="records",
    ),
)
