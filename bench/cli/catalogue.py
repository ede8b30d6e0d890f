"""The protocols that the command line offers: one row each."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

from protocols.harmonic.parameters import HarmonicParameters
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

    `passed` turns the summary of a run that was carried out into its exit code: 0, or 1 when it is False.
    """

    name: str
    summary: str
    details: str
    parameters: type[Parameters]
    campaign: Callable[[Any], "Experiment"]
    progress: Progress = _live
    passed: Callable[[Mapping[str, Any]], bool] = _always


def _harmonic(parameters: HarmonicParameters) -> "Experiment":
    from protocols.harmonic.campaign import HarmonicCampaign

    return HarmonicCampaign(parameters)


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
)
