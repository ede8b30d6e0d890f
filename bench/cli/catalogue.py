"""The protocols that the command line offers: one row each."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from protocols.harmonic.parameters import HarmonicParameters
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.session import Experiment


@dataclass(frozen=True)
class Entry:
    """A protocol on the command line: its flags come from `parameters`, and `campaign` makes it from an instance."""

    name: str
    summary: str
    details: str
    parameters: type[Parameters]
    campaign: Callable[[Any], "Experiment"]


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
